//! Facts about a picture, stored beside its pixels.

/// A fact about a picture.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Words.
    Text(String),
    /// A count. Files hold 32 bits; larger ones are written as text, digit for digit.
    Integer(i64),
    /// A measure.
    Real(f64),
}

impl Value {
    /// The integer, also where it had to be written as text.
    pub fn as_integer(&self) -> Option<i128> {
        match self {
            Self::Integer(i) => Some(i128::from(*i)),
            Self::Text(text) => text.parse().ok(),
            Self::Real(_) => None,
        }
    }

    /// The number, whether it was written as an integer or a measure.
    pub fn as_real(&self) -> Option<f64> {
        match self {
            Self::Real(x) => Some(*x),
            Self::Integer(i) => Some(*i as f64),
            Self::Text(_) => None,
        }
    }
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Text(text) => f.pad(text),
            Self::Integer(i) => i.fmt(f),
            Self::Real(x) => x.fmt(f),
        }
    }
}

impl From<&str> for Value {
    fn from(text: &str) -> Self {
        Self::Text(text.into())
    }
}

impl From<String> for Value {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<u32> for Value {
    fn from(i: u32) -> Self {
        Self::Integer(i.into())
    }
}

/// Exact: what does not fit a signed integer (a seed may) becomes text.
impl From<u64> for Value {
    fn from(i: u64) -> Self {
        i64::try_from(i).map_or_else(|_| Self::Text(i.to_string()), Self::Integer)
    }
}

impl From<i64> for Value {
    fn from(i: i64) -> Self {
        Self::Integer(i)
    }
}

impl From<f64> for Value {
    fn from(x: f64) -> Self {
        Self::Real(x)
    }
}

/// Named facts about a picture, in order: version, scene, seed, passes, … In a file each name is prefixed
/// `halflight.`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Header {
    /// Name (without the prefix) and value.
    pub entries: Vec<(String, Value)>,
}

impl Header {
    /// No facts.
    pub fn new() -> Self {
        Self::default()
    }

    /// States a fact, in place of an earlier one of the same name.
    pub fn set(&mut self, name: &str, value: impl Into<Value>) {
        let value = value.into();
        match self.entries.iter_mut().find(|(n, _)| n == name) {
            Some(entry) => entry.1 = value,
            None => self.entries.push((name.into(), value)),
        }
    }

    /// The same, to chain.
    #[must_use]
    pub fn with(mut self, name: &str, value: impl Into<Value>) -> Self {
        self.set(name, value);
        self
    }

    /// A fact by its name.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.entries.iter().find(|(n, _)| n == name).map(|(_, value)| value)
    }
}
