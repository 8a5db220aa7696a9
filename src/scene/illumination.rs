use crate::light::Matrix;
use std::str::FromStr;

/// What the user calls an illumination: a point of the square, a preset, or matrices of the user's own.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Illumination {
    /// F(s, t): s turns on inter-reflection, t turns off shadows; both in [0, 1].
    Square {
        /// Inter-reflection.
        s: f32,
        /// Shadowlessness.
        t: f32,
    },
    /// Delta lobes pass the visible half on, as in classical ray tracing; straight as the surroundings.
    Whitted,
    /// Any two non-negative matrices.
    Own(Matter),
}

/// The two coefficient matrices of a material: of f_opaque (all lobes) and of f_transp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Matter {
    /// Multiplies every lobe.
    pub opaque: Matrix,
    /// Multiplies what goes straight on.
    pub straight: Matrix,
}

impl Illumination {
    /// Shadows, no inter-reflection: paper eq. 23.
    pub const ONE_BOUNCE: Self = Self::Square { s: 0.0, t: 0.0 };
    /// Neither: paper eq. 14, OpenGL's local illumination.
    pub const LOCAL: Self = Self::Square { s: 0.0, t: 1.0 };
    /// Both: paper eq. 19, conventional global illumination.
    pub const GLOBAL: Self = Self::Square { s: 1.0, t: 0.0 };
    /// Inter-reflection, no shadows: paper eq. 21.
    pub const SHADOWLESS: Self = Self::Square { s: 1.0, t: 1.0 };

    /// What can be written for an illumination, for messages.
    pub const WORDS: &'static str = "global, local, shadowless, one-bounce, whitted or S,T with both in 0…1";

    /// The matrices, given those of the surroundings (which only [`Whitted`](Self::Whitted) reads).
    pub fn matter(self, surroundings: Matter) -> Matter {
        match self {
            // F(s, t) = [[s f_opaque + t f_transp, 0], [f_opaque, 0]]
            Self::Square { s, t } => Matter {
                opaque: Matrix::new([[s, 0.0], [1.0, 0.0]]),
                straight: Matrix::new([[t, 0.0], [0.0, 0.0]]),
            },
            Self::Whitted => {
                Matter { opaque: Matrix::new([[0.0, 0.0], [0.0, 1.0]]), straight: surroundings.straight }
            }
            Self::Own(matter) => matter,
        }
    }

    /// The matrices where nothing surrounds it.
    pub fn own_matter(self) -> Matter {
        self.matter(Matter { opaque: Matrix::ZERO, straight: Matrix::ZERO })
    }

    /// The name of a corner or preset, or the numbers.
    pub fn describe(self) -> String {
        match self {
            Self::ONE_BOUNCE => "one-bounce".into(),
            Self::LOCAL => "local".into(),
            Self::GLOBAL => "global".into(),
            Self::SHADOWLESS => "shadowless".into(),
            Self::Square { s, t } => format!("{s},{t}"),
            Self::Whitted => "whitted".into(),
            Self::Own(Matter { opaque, straight }) => {
                let write = |m: Matrix| {
                    let [[a, b], [c, d]] = m.rows();
                    format!("{a},{b},{c},{d}")
                };
                format!("{}/{}", write(opaque), write(straight))
            }
        }
    }
}

impl FromStr for Illumination {
    type Err = String;

    /// A name, `S,T`, or `A,B,C,D/E,F,G,H` (rows of the opaque and of the straight matrix).
    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "global" => return Ok(Self::GLOBAL),
            "local" => return Ok(Self::LOCAL),
            "shadowless" => return Ok(Self::SHADOWLESS),
            "one-bounce" => return Ok(Self::ONE_BOUNCE),
            "whitted" => return Ok(Self::Whitted),
            _ => {}
        }
        let wrong = || {
            format!("`{text}` is no illumination; write {}, or eight numbers A,B,C,D/E,F,G,H", Self::WORDS)
        };
        if let Some((opaque, straight)) = text.split_once('/') {
            let matrix = |part: &str| numbers::<4>(part).and_then(|m| matrix_from(m).ok()).ok_or_else(wrong);
            return Ok(Self::Own(Matter { opaque: matrix(opaque)?, straight: matrix(straight)? }));
        }
        let [s, t] = numbers::<2>(text).ok_or_else(wrong)?;
        square_from(s, t).map_err(|_| wrong())
    }
}

/// A point of the square from two numbers, which must lie in [0, 1].
pub(super) fn square_from(s: f32, t: f32) -> Result<Illumination, String> {
    if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
        Ok(Illumination::Square { s, t })
    } else {
        Err(format!("[{s}, {t}] lies outside the square; both numbers go from 0 to 1"))
    }
}

/// A matrix from four numbers, row-major, which must be finite and not negative.
pub(super) fn matrix_from(m: [f32; 4]) -> Result<Matrix, String> {
    if m.iter().all(|x| x.is_finite() && *x >= 0.0) {
        Ok(Matrix::new([[m[0], m[1]], [m[2], m[3]]]))
    } else {
        Err(format!("{m:?} has an entry that is negative or not finite"))
    }
}

fn numbers<const N: usize>(text: &str) -> Option<[f32; N]> {
    let values: Option<Vec<f32>> = text.split(',').map(|x| x.trim().parse().ok()).collect();
    values?.try_into().ok()
}
