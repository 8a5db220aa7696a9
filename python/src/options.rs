//! Keyword arguments, each of which is read once; what is left over is refused.

use crate::errors::usage;
use halflight::scene::Illumination;
use pyo3::exceptions::{PyKeyboardInterrupt, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::cell::RefCell;

/// The keyword arguments of a call.
pub struct Options<'py> {
    call: &'static str,
    given: Option<Bound<'py, PyDict>>,
    known: RefCell<Vec<&'static str>>,
}

impl<'py> Options<'py> {
    /// `call` is for messages. What is read is taken out of a copy.
    pub fn of(call: &'static str, given: Option<&Bound<'py, PyDict>>) -> PyResult<Self> {
        let given = given.map(PyDictMethods::copy).transpose()?;
        Ok(Self { call, given, known: RefCell::default() })
    }

    /// An argument as it is. None: it is not there, or None.
    pub fn any(&self, name: &'static str) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.known.borrow_mut().push(name);
        let Some(given) = &self.given else { return Ok(None) };
        let Some(value) = given.get_item(name)? else { return Ok(None) };
        given.del_item(name)?;
        Ok(Some(value).filter(|value| !value.is_none()))
    }

    /// An argument of a kind; `what` says which, as in "a whole number".
    pub fn get<T>(&self, name: &'static str, what: &str) -> PyResult<Option<T>>
    where
        T: for<'a> FromPyObject<'a, 'py>,
    {
        self.read(name, |value| {
            let wrong = || usage(format!("{name}={}: not {what}", shown(value)));
            value.extract::<T>().map_err(|_| wrong())
        })
    }

    /// An argument that `read` understands.
    pub fn read<T>(
        &self,
        name: &'static str,
        read: impl FnOnce(&Bound<'py, PyAny>) -> PyResult<T>,
    ) -> PyResult<Option<T>> {
        self.any(name)?.map(|value| read(&value)).transpose()
    }

    /// An argument that is written as on the command line.
    pub fn word<T>(&self, name: &'static str) -> PyResult<Option<T>>
    where
        T: std::str::FromStr,
        T::Err: std::fmt::Display,
    {
        self.read(name, |value| {
            let text = value.str()?.to_string();
            text.parse().map_err(|why| usage(format!("{name}: {why}")))
        })
    }

    /// Refuses what nobody asked for.
    pub fn finish(self) -> PyResult<()> {
        let left = self.given.as_ref().and_then(|given| given.keys().get_item(0).ok());
        match left {
            None => Ok(()),
            Some(name) => Err(PyTypeError::new_err(format!(
                "{}: there is no argument `{name}`; there are {}",
                self.call,
                self.known.borrow().join(", ")
            ))),
        }
    }
}

fn shown(value: &Bound<'_, PyAny>) -> String {
    value.repr().map_or_else(|_| "…".into(), |repr| repr.to_string())
}

/// An illumination: a name as on the command line, or a point (s, t) of the square.
pub fn illumination(value: &Bound<'_, PyAny>) -> PyResult<Illumination> {
    let text = match value.extract::<(f64, f64)>() {
        Ok((s, t)) => format!("{s},{t}"),
        Err(error) if error.is_instance_of::<PyKeyboardInterrupt>(value.py()) => return Err(error),
        Err(_) => value.str()?.to_string(),
    };
    text.parse().map_err(|why| usage(format!("illumination: {why}")))
}

/// The halves in which something shines, as factors: "both", "invisible" (lights but is not seen), or (invisible, visible).
pub fn halves(value: Option<&Bound<'_, PyAny>>) -> PyResult<[f32; 2]> {
    let Some(value) = value else { return Ok([1.0; 2]) };
    match value.extract::<String>().as_deref() {
        Ok("both") => return Ok([1.0; 2]),
        Ok("invisible") => return Ok([1.0, 0.0]),
        _ => {}
    }
    let pair = value.extract::<(f32, f32)>().ok().filter(|(a, b)| *a >= 0.0 && *b >= 0.0);
    pair.map(|(invisible, visible)| [invisible, visible]).ok_or_else(|| {
        usage(format!("halves={}: give \"both\", \"invisible\", or two factors of 0 or more", shown(value)))
    })
}
