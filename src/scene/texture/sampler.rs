use std::ops::Range;

/// How an image goes on beyond an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// From its other edge.
    #[default]
    Repeat,
    /// Turned round at every edge.
    Mirrored,
    /// As its outermost texels are.
    Clamp,
}

/// How an image goes on beyond its edges and between its texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Sampler {
    /// Beyond its left and right edge, and beyond its upper and lower one.
    pub wrap: [Wrap; 2],
    /// Between texels, linearly; else texels are squares of one colour where they are larger than what looks.
    pub linear: bool,
}

impl Default for Sampler {
    /// As in glTF where nothing is said.
    fn default() -> Self {
        Self { wrap: [Wrap::Repeat; 2], linear: true }
    }
}

impl Wrap {
    /// A place on an axis of `size` texels, in texels, brought near the image: in [0, `size`], for mirrored images in
    /// [0, 2 `size`].
    #[inline]
    pub(super) fn place(self, coordinate: f32, size: f32) -> f32 {
        let place = match self {
            Self::Repeat => coordinate - coordinate.floor(),
            Self::Mirrored => coordinate - 2.0 * (0.5 * coordinate).floor(),
            Self::Clamp => coordinate.clamp(0.0, 1.0),
        };
        // Coordinates that overflow on their way lead somewhere.
        if place.is_finite() { size * place } else { 0.0 }
    }

    /// Whole places of all texels that are seen between two coordinates, on an axis of `size` texels. None: they are too far away.
    pub(super) fn texels(self, [low, high]: [f32; 2], size: u32, linear: bool) -> Option<Range<i32>> {
        let (back, on) = if linear { (0.5, 1.0) } else { (0.0, 0.0) };
        let place = |coordinate: f32| f64::from(coordinate) * f64::from(size) - back;
        // What rounding does to coordinates.
        let slack = 0.01 + f64::from(low.abs().max(high.abs())) * f64::from(size) * f64::from(f32::EPSILON);
        let (first, last) = ((place(low) - slack).floor(), (place(high) + slack).floor() + on);
        if !first.is_finite() || !last.is_finite() || first.abs().max(last.abs()) >= f64::from(i32::MAX / 4) {
            return None;
        }
        let (first, end, n) = (first as i32, last as i32 + 1, size as i32);
        Some(match self {
            Self::Repeat => first..end.min(first + n),
            Self::Mirrored => first..end.min(first + 2 * n),
            Self::Clamp => first.clamp(0, n - 1)..end.clamp(1, n),
        })
    }

    /// The texel at a whole place at most one beyond those of [`place`](Self::place).
    #[inline]
    pub(super) fn texel(self, place: i32, size: u32) -> u32 {
        let n = size as i32;
        let texel = match self {
            Self::Repeat => place.rem_euclid(n),
            Self::Clamp => place.clamp(0, n - 1),
            Self::Mirrored => {
                let place = place.rem_euclid(2 * n);
                place.min(2 * n - 1 - place)
            }
        };
        texel as u32
    }
}
