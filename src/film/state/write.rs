//! A state as bytes.

use super::super::exact::{Number, Row, Whole};
use super::super::replace::replace_file;
use super::super::sums::{Film, Sums};
use super::{
    BYTES, FAR, INFINITE, LONGEST_HEAD, MAGIC, MINUS_INFINITE, NEGATIVE, NOT_A_NUMBER, StateHead, VERSION,
    ZERO, checksum,
};
use crate::error::{Error, Result};
use rayon::prelude::*;
use std::io::{self, Write};
use std::path::Path;

/// Rows that are made ready at once: some megabytes.
const ROWS: usize = 64;

/// Writes the sums of a film with what is to be said of them; the same film gives the same bytes. Written aside and renamed.
///
/// # Errors
/// It cannot be written; the old file is as it was.
pub fn write_state(path: &Path, head: &StateHead, film: &Film) -> Result<()> {
    let json = head.to_json().to_string();
    if json.len() > LONGEST_HEAD as usize {
        let reason = format!("its passes are in too many pieces ({}); merge states in order", head.passes);
        return Err(Error::Write { path: path.into(), reason });
    }
    replace_file(path, |file| {
        file.write_all(MAGIC)?;
        file.write_all(&VERSION.to_le_bytes())?;
        block(file, json.as_bytes())?;
        block(file, &colours(&film.sums))?;
        let rows: Vec<usize> = (0..film.height() as usize).collect();
        for rows in rows.chunks(ROWS) {
            let blocks: Vec<Vec<u8>> = rows.par_iter().map(|y| row(&film.sums, *y)).collect();
            blocks.iter().try_for_each(|bytes| block(file, bytes))?;
        }
        Ok(())
    })
}

/// Bytes after their number and before their checksum.
fn block(file: &mut dyn Write, bytes: &[u8]) -> io::Result<()> {
    file.write_all(&(bytes.len() as u32).to_le_bytes())?;
    file.write_all(bytes)?;
    file.write_all(&checksum(bytes).to_le_bytes())
}

fn colours(sums: &Sums) -> Vec<u8> {
    let mut bytes = Vec::new();
    sums.colour.iter().for_each(|row| numbers(&mut bytes, row));
    bytes
}

fn row(sums: &Sums, y: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    sums.layers.iter().for_each(|(_, rows)| numbers(&mut bytes, &rows[y]));
    numbers(&mut bytes, &sums.squares[y]);
    sums.bias.iter().for_each(|rows| numbers(&mut bytes, &rows[y]));
    sums.peaks[y].bits().for_each(|peak| bytes.extend(peak.to_le_bytes()));
    bytes
}

/// The lowest exponent, then each number.
fn numbers<W: Whole>(bytes: &mut Vec<u8>, row: &Row<W>) {
    let all: Vec<Number> = (0..row.len()).map(|i| row.number(i)).collect();
    let exponent = |number: &Number| match number {
        Number::Finite { exponent, .. } => Some(*exponent as i16),
        _ => None,
    };
    let lowest = all.iter().filter_map(exponent).min().unwrap_or(0);
    bytes.extend(lowest.to_le_bytes());
    for number in &all {
        match number {
            Number::Zero => bytes.push(ZERO),
            Number::Infinite => bytes.push(INFINITE),
            Number::MinusInfinite => bytes.push(MINUS_INFINITE),
            Number::Nan => bytes.push(NOT_A_NUMBER),
            Number::Finite { negative, exponent, magnitude } => {
                bytes.push((BYTES + magnitude.len() as u8) | if *negative { NEGATIVE } else { 0 });
                let above = *exponent as i16 - lowest;
                match u8::try_from(above) {
                    Ok(above) if above != FAR => bytes.push(above),
                    _ => {
                        bytes.push(FAR);
                        bytes.extend((*exponent as i16).to_le_bytes());
                    }
                }
                bytes.extend(magnitude);
            }
        }
    }
}
