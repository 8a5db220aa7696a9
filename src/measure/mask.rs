//! Which pixels are left out of error figures.

use glam::Vec3;

/// Marks pixels with a component above `limit`. Pixels that are not a number are not marked: they are to be
/// reported, not hidden.
pub fn brighter_than(plane: &[Vec3], limit: f32) -> Vec<bool> {
    plane.iter().map(|v| v.to_array().iter().any(|&c| c > limit)).collect()
}

/// Grows a mask by `by` pixels in every direction, diagonals too (a square of side 2·`by` + 1).
pub fn dilated(mask: &[bool], width: u32, by: u32) -> Vec<bool> {
    let (width, by) = (width as usize, by as usize);
    let height = mask.len() / width.max(1);
    // A square grows along rows, then along columns.
    let along = |mask: &[bool], count: usize, stride: usize, lines: usize, line_stride: usize| {
        let mut grown = vec![false; mask.len()];
        for line in 0..lines {
            for i in (0..count).filter(|i| mask[line * line_stride + i * stride]) {
                for j in i.saturating_sub(by)..=i.saturating_add(by).min(count - 1) {
                    grown[line * line_stride + j * stride] = true;
                }
            }
        }
        grown
    };
    let rows = along(mask, width, 1, height, width);
    along(&rows, height, width, width, 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_grows_to_a_square_and_stops_at_the_border() {
        let mut mask = vec![false; 5 * 4];
        mask[5] = true; // column 0, row 1
        let grown = dilated(&mask, 5, 1);
        let expected = [[1, 1, 0, 0, 0], [1, 1, 0, 0, 0], [1, 1, 0, 0, 0], [0; 5]];
        assert_eq!(grown, expected.concat().iter().map(|&b| b == 1).collect::<Vec<_>>());
        assert_eq!(dilated(&mask, 5, 0), mask);
        assert!(dilated(&mask, 5, u32::MAX).iter().all(|&m| m));
    }

    #[test]
    fn lost_pixels_are_not_hidden_by_brightness() {
        let plane = [Vec3::new(0.0, 0.0, 2.0), Vec3::splat(f32::NAN), Vec3::INFINITY, Vec3::ONE];
        assert_eq!(brighter_than(&plane, 1.0), [true, false, true, false]);
    }
}
