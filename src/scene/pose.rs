use std::str::FromStr;

/// A moment of an animation.
#[derive(Clone, Debug, PartialEq)]
pub struct Pose {
    /// Which animation, by its name, else by its number from 0. None: the first.
    pub animation: Option<String>,
    /// When, s from its beginning. Before it and after it the animation stands still.
    pub seconds: f64,
}

impl FromStr for Pose {
    type Err = String;

    /// `SECONDS` or `NAME:SECONDS`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (animation, seconds) = match text.rsplit_once(':') {
            Some((name, seconds)) => (Some(name.to_owned()), seconds),
            None => (None, text),
        };
        match seconds.trim().parse::<f64>() {
            Ok(seconds) if seconds.is_finite() => Ok(Self { animation, seconds }),
            _ => Err(format!("`{text}` is no moment; write SECONDS or NAME:SECONDS, as in 1.5 or Walk:1.5")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_is_a_time_with_or_without_a_name() {
        let pose =
            |animation: Option<&str>, seconds| Ok(Pose { animation: animation.map(Into::into), seconds });
        assert_eq!("1.5".parse(), pose(None, 1.5));
        assert_eq!("Walk:0".parse(), pose(Some("Walk"), 0.0));
        assert_eq!("a:b: 2e1".parse(), pose(Some("a:b"), 20.0));
        for wrong in ["", "Walk", "Walk:", "nan", "Walk:inf", "1:x"] {
            assert!(wrong.parse::<Pose>().is_err_and(|e| e.contains("NAME:SECONDS")), "{wrong}");
        }
    }
}
