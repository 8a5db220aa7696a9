//! The two-half algebra: light is a column, what a pixel reads is a row, matter is a matrix between them.
//!
//! **Shooting multiplies matrices onto the light from the left; gathering multiplies matrices onto the row from
//! the right.** Both give the same number because `row * (M * light) == (row * M) * light`, and that is the only
//! reason the two methods agree.
//!
//! ```
//! use glam::Vec3;
//! use halflight::light::{Light, Matrix, Row};
//! let light = Light::both(Vec3::ONE);
//! let first = Matrix::new([[1.0, 0.0], [1.0, 0.0]]);
//! let second = Matrix::new([[0.0, 0.0], [0.5, 0.0]]);
//! let shot = Row::VISIBLE * (second * (first * light));
//! let gathered = ((Row::VISIBLE * second) * first) * light;
//! assert_eq!(shot, gathered);
//! assert_eq!(shot, Vec3::splat(0.5));
//! ```

use glam::Vec3;
use std::ops::{Add, AddAssign, Mul};

/// What re-radiation does to colours: what came as one leaves as the next, or as the next but one (red, green, blue, red, …). Every
/// 3×3 matrix is a sum of three diagonal ones, each behind such a turn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Turn(u8);

/// Set where light was re-radiated at all: three turns by one colour lead back to the first.
const RERADIATED: u8 = 4;

impl Turn {
    /// Colours stay what they are: matter that does not fluoresce.
    pub const NONE: Self = Self(0);

    /// Re-radiation of colour c as colour c + `by`, modulo three.
    pub const fn by(by: u8) -> Self {
        Self((by % 3) | RERADIATED)
    }

    /// By how many colours, 0 to 2.
    pub const fn colours(self) -> usize {
        (self.0 & 3) as usize
    }

    /// True for light that was re-radiated, be it in its own colour.
    pub const fn is_reradiated(self) -> bool {
        self.0 & RERADIATED != 0
    }

    /// One after the other.
    #[must_use]
    pub const fn then(self, other: Self) -> Self {
        Self((((self.0 & 3) + (other.0 & 3)) % 3) | ((self.0 | other.0) & RERADIATED))
    }

    /// What leaves as each colour, of what came as each.
    #[inline(always)]
    pub fn outgoing(self, came: Vec3) -> Vec3 {
        match self.0 & 3 {
            0 => came,
            1 => Vec3::new(came.z, came.x, came.y),
            _ => Vec3::new(came.y, came.z, came.x),
        }
    }

    /// By what each colour came of which this leaves as each.
    #[inline(always)]
    pub fn incoming(self, leaves: Vec3) -> Vec3 {
        match self.0 & 3 {
            0 => leaves,
            1 => Vec3::new(leaves.y, leaves.z, leaves.x),
            _ => Vec3::new(leaves.z, leaves.x, leaves.y),
        }
    }
}

/// Vector-valued light, paper eq. 7: an invisible half that travels and a visible half that is seen, each linear RGB.
///
/// The unit is that of its context: W for a photon's power, W m⁻² sr⁻¹ for radiance, W sr⁻¹ for intensity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Light {
    /// The half that ordinary matter reads (first column of its matrix).
    pub invisible: Vec3,
    /// The half that a pixel shows, paper eq. 8.
    pub visible: Vec3,
}

impl Light {
    /// No light.
    pub const ZERO: Self = Self { invisible: Vec3::ZERO, visible: Vec3::ZERO };

    /// Light with the given halves.
    pub const fn new(invisible: Vec3, visible: Vec3) -> Self {
        Self { invisible, visible }
    }

    /// Light whose two halves are equal, paper eq. 11.
    pub const fn both(rgb: Vec3) -> Self {
        Self { invisible: rgb, visible: rgb }
    }

    /// What there is of each colour, both halves together.
    pub fn colours(self) -> Vec3 {
        self.invisible + self.visible
    }

    /// The sum of all six components: what "power" means where one number must choose (roulette, lobe choice).
    pub fn total(self) -> f32 {
        (self.invisible + self.visible).element_sum()
    }

    /// In the components in which `other` is above zero, and zero in the rest.
    pub fn kept_where(self, other: Self) -> Self {
        let kept = |own: Vec3, other: Vec3| Vec3::select(other.cmpgt(Vec3::ZERO), own, Vec3::ZERO);
        Self::new(kept(self.invisible, other.invisible), kept(self.visible, other.visible))
    }

    /// True when all six components are finite.
    pub fn is_finite(self) -> bool {
        self.invisible.is_finite() && self.visible.is_finite()
    }

    /// True when all six components are exactly zero.
    pub fn is_zero(self) -> bool {
        self == Self::ZERO
    }
}

impl Add for Light {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.invisible + other.invisible, self.visible + other.visible)
    }
}

impl AddAssign for Light {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

/// Colour filtering: both halves are multiplied by one RGB weight (a scalar lobe acts on the halves alike).
impl Mul<Light> for Vec3 {
    type Output = Light;
    fn mul(self, light: Light) -> Light {
        Light::new(self * light.invisible, self * light.visible)
    }
}

impl Mul<Light> for f32 {
    type Output = Light;
    fn mul(self, light: Light) -> Light {
        Light::new(self * light.invisible, self * light.visible)
    }
}

/// A 2×2 coefficient matrix: rows are the outgoing half, columns the incoming half, invisible first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Matrix {
    /// What invisible light becomes invisible.
    pub inv_inv: f32,
    /// What visible light becomes invisible.
    pub inv_vis: f32,
    /// What invisible light becomes visible.
    pub vis_inv: f32,
    /// What visible light becomes visible.
    pub vis_vis: f32,
}

impl Matrix {
    /// Nothing comes out.
    pub const ZERO: Self = Self::new([[0.0, 0.0], [0.0, 0.0]]);
    /// Everything comes out as it went in.
    pub const IDENTITY: Self = Self::new([[1.0, 0.0], [0.0, 1.0]]);

    /// From rows, as one writes it: `[[inv←inv, inv←vis], [vis←inv, vis←vis]]`.
    pub const fn new(rows: [[f32; 2]; 2]) -> Self {
        Self { inv_inv: rows[0][0], inv_vis: rows[0][1], vis_inv: rows[1][0], vis_vis: rows[1][1] }
    }

    /// The rows, as one writes them.
    pub const fn rows(self) -> [[f32; 2]; 2] {
        [[self.inv_inv, self.inv_vis], [self.vis_inv, self.vis_vis]]
    }

    /// Entry by entry.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            inv_inv: self.inv_inv + other.inv_inv,
            inv_vis: self.inv_vis + other.inv_vis,
            vis_inv: self.vis_inv + other.vis_inv,
            vis_vis: self.vis_vis + other.vis_vis,
        }
    }

    /// True when every entry is exactly zero.
    pub fn is_zero(self) -> bool {
        self == Self::ZERO
    }

    /// True when the off-diagonal entries are exactly zero; diagonal matrices commute with each other.
    pub fn is_diagonal(self) -> bool {
        self.inv_vis == 0.0 && self.vis_inv == 0.0
    }
}

impl From<[[f32; 2]; 2]> for Matrix {
    /// From rows.
    fn from(rows: [[f32; 2]; 2]) -> Self {
        Self::new(rows)
    }
}

impl Mul<Light> for Matrix {
    type Output = Light;
    fn mul(self, light: Light) -> Light {
        Light::new(
            self.inv_inv * light.invisible + self.inv_vis * light.visible,
            self.vis_inv * light.invisible + self.vis_vis * light.visible,
        )
    }
}

/// `a * b`: light meets `b` first.
impl Mul for Matrix {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        Self {
            inv_inv: self.inv_inv * b.inv_inv + self.inv_vis * b.vis_inv,
            inv_vis: self.inv_inv * b.inv_vis + self.inv_vis * b.vis_vis,
            vis_inv: self.vis_inv * b.inv_inv + self.vis_vis * b.vis_inv,
            vis_vis: self.vis_inv * b.inv_vis + self.vis_vis * b.vis_vis,
        }
    }
}

impl Mul<Matrix> for f32 {
    type Output = Matrix;
    fn mul(self, m: Matrix) -> Matrix {
        Matrix {
            inv_inv: self * m.inv_inv,
            inv_vis: self * m.inv_vis,
            vis_inv: self * m.vis_inv,
            vis_vis: self * m.vis_vis,
        }
    }
}

/// What is read from light: one weight for each half and colour of it. A pixel starts with [`Row::VISIBLE`], paper eq. 8.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// Weights of the invisible half, by the colours of the light that is read.
    pub invisible: Vec3,
    /// Weights of the visible half.
    pub visible: Vec3,
    /// As which colours of the pixel they are read.
    pub turn: Turn,
}

impl Row {
    /// Reads nothing.
    pub const ZERO: Self = Self { invisible: Vec3::ZERO, visible: Vec3::ZERO, turn: Turn::NONE };
    /// `[0 1]`: what a pixel of the picture shows.
    pub const VISIBLE: Self = Self { visible: Vec3::ONE, ..Self::ZERO };
    /// `[1 0]`: what a pixel of the `invisible` layer shows.
    pub const INVISIBLE: Self = Self { invisible: Vec3::ONE, ..Self::ZERO };

    /// True when all six weights are exactly zero: nothing beyond can be read.
    pub fn is_zero(self) -> bool {
        self.invisible == Vec3::ZERO && self.visible == Vec3::ZERO
    }

    /// What this reads of light that `turn` re-radiates, as a row that reads light before that.
    #[inline(always)]
    #[must_use]
    pub fn before(self, turn: Turn) -> Self {
        // Most matter: no other colour is looked for.
        if turn == Turn::NONE {
            return self;
        }
        Self {
            invisible: turn.incoming(self.invisible),
            visible: turn.incoming(self.visible),
            turn: self.turn.then(turn),
        }
    }

    /// What is read of each colour of light, both halves together.
    pub fn colours(self) -> Vec3 {
        self.invisible + self.visible
    }

    /// The sum of all six weights: how much this row still reads, as one number.
    pub fn total(self) -> f32 {
        (self.invisible + self.visible).element_sum()
    }
}

impl Mul<Matrix> for Row {
    type Output = Self;
    fn mul(self, m: Matrix) -> Self {
        Self {
            invisible: self.invisible * m.inv_inv + self.visible * m.vis_inv,
            visible: self.invisible * m.inv_vis + self.visible * m.vis_vis,
            turn: self.turn,
        }
    }
}

/// A scalar lobe on the way: both weights are filtered alike.
impl Mul<Vec3> for Row {
    type Output = Self;
    fn mul(self, weight: Vec3) -> Self {
        Self { invisible: self.invisible * weight, visible: self.visible * weight, turn: self.turn }
    }
}

impl Mul<f32> for Row {
    type Output = Self;
    fn mul(self, weight: f32) -> Self {
        Self { invisible: self.invisible * weight, visible: self.visible * weight, turn: self.turn }
    }
}

/// The reading: linear RGB of the pixel.
impl Mul<Light> for Row {
    type Output = Vec3;
    fn mul(self, light: Light) -> Vec3 {
        self.turn.outgoing(self.invisible * light.invisible + self.visible * light.visible)
    }
}

/// What a photon carries: both halves ([`Light`]), or the invisible half alone ([`Invisible`]) where nothing in the
/// scene ever reads the other. Kernels are generic over it, so that what is left out costs nothing.
pub trait Power: Copy + Default + Send + Sync + Add<Output = Self> + AddAssign {
    /// The part of `light` that is carried.
    fn of(light: Light) -> Self;
    /// After matter with this coefficient matrix.
    fn through(self, matrix: Matrix) -> Self;
    /// After a scalar lobe with this RGB weight.
    fn filtered(self, weight: Vec3) -> Self;
    /// Multiplied by a number.
    fn scaled(self, factor: f32) -> Self;
    /// Re-radiated.
    fn turned(self, turn: Turn) -> Self;
    /// The sum of all components carried: what "power" means where one number must choose.
    fn total(self) -> f32;
    /// What `row` reads from it, linear RGB.
    fn read(self, row: Row) -> Vec3;
    /// The components, invisible half first.
    fn light(self) -> Light;
    /// How many numbers are carried.
    const COMPONENTS: usize;
    /// One of them.
    fn component(self, index: usize) -> f32;
    /// From all of them.
    fn from_components(component: impl Fn(usize) -> f32) -> Self;
}

impl Power for Light {
    fn of(light: Light) -> Self {
        light
    }
    fn through(self, matrix: Matrix) -> Self {
        matrix * self
    }
    fn filtered(self, weight: Vec3) -> Self {
        weight * self
    }
    fn scaled(self, factor: f32) -> Self {
        factor * self
    }
    fn turned(self, turn: Turn) -> Self {
        Self::new(turn.outgoing(self.invisible), turn.outgoing(self.visible))
    }
    fn total(self) -> f32 {
        self.total()
    }
    fn read(self, row: Row) -> Vec3 {
        row * self
    }
    fn light(self) -> Light {
        self
    }
    const COMPONENTS: usize = 6;
    fn component(self, index: usize) -> f32 {
        if index < 3 { self.invisible[index] } else { self.visible[index - 3] }
    }
    fn from_components(component: impl Fn(usize) -> f32) -> Self {
        let half = |first: usize| Vec3::from_array(std::array::from_fn(|i| component(first + i)));
        Self::new(half(0), half(3))
    }
}

/// The invisible half alone: all that travels where no matrix has a second column.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Invisible(pub Vec3);

impl Add for Invisible {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl AddAssign for Invisible {
    fn add_assign(&mut self, other: Self) {
        self.0 += other.0;
    }
}

impl Power for Invisible {
    fn of(light: Light) -> Self {
        Self(light.invisible)
    }
    fn through(self, matrix: Matrix) -> Self {
        Self(matrix.inv_inv * self.0)
    }
    fn filtered(self, weight: Vec3) -> Self {
        Self(weight * self.0)
    }
    fn scaled(self, factor: f32) -> Self {
        Self(factor * self.0)
    }
    fn turned(self, turn: Turn) -> Self {
        Self(turn.outgoing(self.0))
    }
    fn total(self) -> f32 {
        self.0.element_sum()
    }
    fn read(self, row: Row) -> Vec3 {
        row.turn.outgoing(row.invisible * self.0)
    }
    fn light(self) -> Light {
        Light::new(self.0, Vec3::ZERO)
    }
    const COMPONENTS: usize = 3;
    fn component(self, index: usize) -> f32 {
        self.0[index]
    }
    fn from_components(component: impl Fn(usize) -> f32) -> Self {
        Self(Vec3::from_array(std::array::from_fn(component)))
    }
}

#[cfg(test)]
mod tests;
