//! Numbers and arrays between Python and the library.

use crate::errors::usage;
use glam::Vec3;
use halflight::light::Matrix;
use halflight::scene::Fluorescence;
use numpy::{AllowTypeChange, PyArray1, PyArray2, PyArray3, PyArrayLike1, PyArrayLike2, PyArrayMethods};
use pyo3::prelude::*;

/// Rows of `N` numbers: an array of shape (n, N), or what numpy makes one of.
pub fn rows<const N: usize>(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec<[f64; N]>> {
    let wrong = || usage(format!("{what}: not numbers of shape (n, {N})"));
    let array: PyArrayLike2<'_, f64, AllowTypeChange> = value.extract().map_err(|_| wrong())?;
    let array = array.as_array();
    // What is empty has no shape of its own.
    if array.ncols() != N && array.nrows() > 0 {
        return Err(wrong());
    }
    Ok(array.rows().into_iter().map(|row| std::array::from_fn(|i| row[i])).collect())
}

/// The same in single precision.
pub fn rows_f32<const N: usize>(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec<[f32; N]>> {
    Ok(rows::<N>(value, what)?.into_iter().map(|row| row.map(|x| x as f32)).collect())
}

/// Three vertex indices a triangle: whole numbers of shape (n, 3).
pub fn triangles(value: &Bound<'_, PyAny>) -> PyResult<Vec<[u32; 3]>> {
    let index = |x: f64| {
        let whole = x.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&x);
        whole.then_some(x as u32).ok_or_else(|| usage(format!("triangles: {x} is no index of a vertex")))
    };
    let triangle = |[a, b, c]: [f64; 3]| Ok([index(a)?, index(b)?, index(c)?]);
    rows::<3>(value, "triangles")?.into_iter().map(triangle).collect()
}

/// Three numbers.
pub fn vec3(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec3> {
    let wrong = || usage(format!("{what}: not three numbers"));
    let array: PyArrayLike1<'_, f64, AllowTypeChange> = value.extract().map_err(|_| wrong())?;
    match *array.as_array().to_vec() {
        [x, y, z] => Ok(Vec3::new(x as f32, y as f32, z as f32)),
        _ => Err(wrong()),
    }
}

/// A colour, linear RGB: three numbers, or one for grey.
pub fn colour(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec3> {
    if let Ok(grey) = value.extract::<f32>() {
        return Ok(Vec3::splat(grey));
    }
    vec3(value, what)
        .map_err(|_| usage(format!("{what}: no colour; give three linear numbers, or one for grey")))
}

/// A 2×2 matrix by rows: the outgoing half is the row, invisible first. None for None.
pub fn matrix(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Option<Matrix>> {
    if value.is_none() {
        return Ok(None);
    }
    let wrong = || usage(format!("{what}: no 2x2 matrix of finite numbers, none of them negative"));
    let rows = rows_f32::<2>(value, what).map_err(|_| wrong())?;
    let rows: [[f32; 2]; 2] = rows.try_into().map_err(|_| wrong())?;
    let fits = rows.iter().flatten().all(|x| x.is_finite() && *x >= 0.0);
    fits.then(|| Some(Matrix::new(rows))).ok_or_else(wrong)
}

/// A 3×3 or 6×6 matrix of re-radiation, or None.
pub fn fluorescence(value: &Bound<'_, PyAny>, gain: bool) -> PyResult<Option<Fluorescence>> {
    if value.is_none() {
        return Ok(None);
    }
    let colours = rows_f32::<3>(value, "fluorescence").ok().and_then(|rows| rows.try_into().ok());
    let full = || rows_f32::<6>(value, "fluorescence").ok().and_then(|rows| rows.try_into().ok());
    let found = colours.map(Fluorescence::colours).or_else(|| full().map(Fluorescence::full));
    let found = found.ok_or_else(|| usage("fluorescence: no 3x3 or 6x6 matrix of numbers"))?;
    Ok(Some(if gain { found.with_gain() } else { found }))
}

/// A matrix as an array of shape (2, 2).
pub fn of_matrix(py: Python<'_>, matrix: Matrix) -> Bound<'_, PyArray2<f32>> {
    PyArray2::from_vec2(py, &matrix.rows().map(Vec::from)).expect("rows of one length")
}

/// A plane of pixels as an array of shape (height, width, 3), which takes its memory over.
pub fn of_plane(
    py: Python<'_>,
    (width, height): (u32, u32),
    plane: Vec<Vec3>,
) -> PyResult<Bound<'_, PyArray3<f32>>> {
    let numbers: Vec<f32> = bytemuck::allocation::cast_vec(plane);
    PyArray1::from_vec(py, numbers).reshape([height as usize, width as usize, 3])
}

/// The first component of a plane as an array of shape (height, width).
pub fn of_numbers<'py>(
    py: Python<'py>,
    (width, height): (u32, u32),
    plane: &[Vec3],
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let numbers = plane.iter().map(|pixel| pixel.x).collect();
    PyArray1::from_vec(py, numbers).reshape([height as usize, width as usize])
}
