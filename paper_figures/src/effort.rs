//! How much work goes into the figures.

/// Sizes and counts.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Side of the pictures of figure 1, pixels.
    pub side: u32,
    /// Photon paths of a pass of figure 1; None: the plan chooses.
    pub paths: Option<u32>,
    /// Passes of shooting in figure 1.
    pub photon_passes: u32,
    /// Passes of gathering in figure 1.
    pub path_passes: u32,
    /// Samples a pixel in each of these.
    pub path_samples: u32,
    /// Size of the pictures of figure 4, pixels.
    pub size: (u32, u32),
    /// Passes of our picture of the five points in figure 4, one sample a pixel each.
    pub five_passes: u32,
    /// Passes of our converged picture of the lamp, [`LAMP_SAMPLES`] samples a pixel each.
    pub lamp_passes: u32,
    /// Seconds on idle cores that each method has in figure 4.
    pub seconds: f64,
}

/// Samples a pixel in each pass of our converged picture.
pub const LAMP_SAMPLES: u32 = 32;

/// The paper's samples a pixel of OpenGL.
pub const OPENGL_SAMPLES: u32 = 64;

impl Effort {
    /// About ten minutes on two idle cores.
    pub const FULL: Self = Self {
        side: 160,
        paths: None,
        photon_passes: 96,
        path_passes: 24,
        path_samples: 16,
        size: (480, 360),
        five_passes: 192,
        lamp_passes: 10,
        seconds: 40.0,
    };
    /// One minute.
    pub const QUICK: Self = Self {
        side: 112,
        paths: Some(100_000),
        photon_passes: 24,
        path_passes: 16,
        path_samples: 8,
        size: (240, 180),
        five_passes: 96,
        lamp_passes: 4,
        seconds: 6.0,
    };

    /// Figure 4 `width` pixels wide, figure 1 in proportion, and samples a pixel as they were.
    pub fn of_width(self, width: u32) -> Self {
        let side = (self.side * width / self.size.0).max(8);
        Self { side, size: (width, (3 * width / 4).max(1)), ..self }
    }
}
