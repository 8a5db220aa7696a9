//! How many connections a camera hit makes: one, and more where the neighbours show that one is not enough.
//!
//! In a penumbra a single connection is all or nothing. A tile is therefore gathered in two goes: every hit makes one connection;
//! then the scatter of the *other* pixels around it says how many its pixel deserves. As that number does not depend
//! on the pixel's own connections, the mean of all of them is unbiased, whatever the rule.

use super::{Pixel, Walk};
use crate::light::{Light, Power, Row};
use crate::optics::Term;
use crate::sampling::Sobol;
use crate::scene::SurfacePoint;
use glam::Vec3;

/// Most connections of a hit.
const MOST: u32 = 16;
/// The relative variance of a pixel for which one connection is enough; four deserve two, as cost and variance balance where the
/// number goes with the standard deviation.
const ENOUGH: f32 = 0.01;
/// Pixels on each side that are asked.
const REACH: usize = 2;

/// A hit whose first connection is made and that may make more.
pub(super) struct Open<'a, const R: usize> {
    /// In its tile.
    pub pixel: usize,
    pub rows: [Row; R],
    pub term: &'a Term,
    pub point: SurfacePoint,
    pub wo: Vec3,
    /// Its connections are points of this sequence; the first is point zero.
    pub sobol: Sobol,
    /// What the first one brought.
    pub first: [Vec3; R],
}

impl<'a, P: Power, const R: usize> Walk<'a, P, R> {
    /// Direct light at a hit by all luminaires that are summed and by one connection to those that are chosen from.
    pub(super) fn connect(&mut self, open: Open<'a, R>, pixel: &mut Pixel<R>) {
        let mut open = open;
        self.connections.to_all(&self.plan.scene, &open.point, |connection| {
            let light = self.look_through(&open, &connection);
            for (parts, row) in pixel.parts.iter_mut().zip(open.rows) {
                parts.direct += row * light;
            }
        });
        if self.connections.are_sampled() {
            open.first = self.connection(&open, 0);
            for (parts, first) in pixel.parts.iter_mut().zip(open.first) {
                parts.direct += first;
            }
            self.open.push(open);
        }
    }

    /// The second go over a tile of `width` pixels a row, of which `direct` is what connections brought by chance.
    pub(super) fn connect_more(&mut self, pixels: &mut [Pixel<R>], width: usize) {
        let open = std::mem::take(&mut self.open);
        let mut sampled = std::mem::take(&mut self.sampled);
        sampled.clear();
        sampled.resize(pixels.len(), 0.0);
        for hit in &open {
            sampled[hit.pixel] += hit.first[0].element_sum();
        }
        let total: Vec<f32> = pixels.iter().map(|pixel| pixel.parts[0].total().element_sum()).collect();
        let wanted = wanted(&sampled, &total, width);
        for hit in &open {
            let n = wanted[hit.pixel];
            if n == 1 {
                continue;
            }
            let mut more = [Vec3::ZERO; R];
            for i in 1..n {
                for (sum, value) in more.iter_mut().zip(self.connection(hit, i)) {
                    *sum += value;
                }
            }
            for ((parts, first), more) in pixels[hit.pixel].parts.iter_mut().zip(hit.first).zip(more) {
                // The mean of all, instead of the first.
                parts.direct += (more - (n - 1) as f32 * first) / n as f32;
            }
        }
        self.sampled = sampled;
        self.open = open;
        self.open.clear();
    }

    /// What connection `i` of a hit brings to each picture.
    fn connection(&self, open: &Open<'_, R>, i: u32) -> [Vec3; R] {
        let connection = self.connections.to_one(&self.plan.scene, &open.point, open.sobol.point(i, 0));
        let light = connection.map_or(Light::ZERO, |connection| self.look_through(open, &connection));
        open.rows.map(|row| row * light)
    }

    /// The light of a connection that is reflected towards the camera.
    fn look_through(&self, open: &Open<'_, R>, connection: &super::connect::Connection) -> Light {
        let normals = &open.point.normals;
        let f =
            open.term.lobe.eval(normals, open.wo, connection.wi) * connection.wi.dot(normals.shading).abs();
        if f == Vec3::ZERO || open.rows.iter().all(|row| *row * connection.light == Vec3::ZERO) {
            return Light::ZERO;
        }
        f * (self.plan.visibility_along(&connection.segment) * connection.light)
    }
}

/// Connections for each pixel of a tile: by the variance of `sampled` over the pixels around it, itself left out, relative to
/// the square of the mean of `total` there.
fn wanted(sampled: &[f32], total: &[f32], width: usize) -> Vec<u32> {
    let height = sampled.len() / width;
    let mut wanted = vec![1; sampled.len()];
    for y in 0..height {
        for x in 0..width {
            let (mut n, mut sum, mut squares, mut all) = (0.0_f32, 0.0, 0.0, 0.0);
            for v in y.saturating_sub(REACH)..=(y + REACH).min(height - 1) {
                for u in x.saturating_sub(REACH)..=(x + REACH).min(width - 1) {
                    if (u, v) != (x, y) {
                        let i = v * width + u;
                        n += 1.0;
                        sum += sampled[i];
                        squares += sampled[i] * sampled[i];
                        all += total[i];
                    }
                }
            }
            let variance = (n * squares - sum * sum) / (all * all);
            // False also where nothing shines.
            if variance > ENOUGH {
                let n = (variance / ENOUGH).sqrt().min(MOST as f32);
                wanted[y * width + x] = (n as u32).next_power_of_two();
            }
        }
    }
    wanted
}
