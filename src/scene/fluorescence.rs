//! Re-radiation: light of one colour that leaves as another, the blocks beside the diagonal of the paper's eq. 17.

use super::check::is_amount;
use crate::light::{Matrix, Turn};
use crate::optics::{Diffuse, Lobe, Term};
use glam::Vec3;

/// What a diffuse surface re-radiates.
///
/// It is not reciprocal, and is not meant to be: blue light leaves as green, and no green light leaves as blue. Colours are the three of
/// the picture, linear; light counts by its power (not by its quanta), so that a column that adds up to one loses nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fluorescence {
    matrix: Reradiation,
    /// More may leave than came.
    gain: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Reradiation {
    /// By outgoing and incoming colour, under the 2×2 matrix of the material's lobes.
    Colours([[f32; 3]; 3]),
    /// Paper eq. 17: by colour and half of what leaves, and of what arrives.
    Full([[f32; 6]; 6]),
}

const COLOURS: [&str; 3] = ["red", "green", "blue"];
const HALVES: [&str; 2] = ["invisible", "visible"];
/// By so much a column of f32 may exceed one through rounding.
const ROUNDING: f32 = 1e-5;

impl Fluorescence {
    /// Beside the base colour, under the same 2×2 matrix: rows are the red, green and blue that leave, columns those that arrive; each a
    /// reflectance, 0 or more.
    pub const fn colours(matrix: [[f32; 3]; 3]) -> Self {
        Self { matrix: Reradiation::Colours(matrix), gain: false }
    }

    /// Of a dye that absorbs these shares of red, green and blue light, and re-radiates the share `efficiency` of that power in
    /// proportion to `emits`.
    pub fn dye(absorbs: [f32; 3], emits: [f32; 3], efficiency: f32) -> Self {
        let whole: f32 = emits.iter().sum();
        Self::colours(emits.map(|emits| absorbs.map(|absorbs| efficiency * absorbs * (emits / whole))))
    }

    /// In place of the base colour and the material's 2×2 matrix of lobes: the matrix of paper eq. 17 as it stands, which multiplies
    /// Lambert's lobe. Rows and columns are (invisible red, visible red, invisible green, visible green, invisible blue, visible blue).
    pub const fn full(matrix: [[f32; 6]; 6]) -> Self {
        Self { matrix: Reradiation::Full(matrix), gain: false }
    }

    /// More may leave than came: an image may then not exist.
    #[must_use]
    pub fn with_gain(self) -> Self {
        Self { gain: true, ..self }
    }

    /// True where it stands in place of Lambert's lobe, and not beside it.
    pub(super) fn replaces(&self) -> bool {
        matches!(self.matrix, Reradiation::Full(_))
    }

    /// Adds the terms by which the share `share` of a surface does it that reflects by `lobe` under the matrix `opaque`.
    pub(super) fn add_terms(&self, terms: &mut Vec<Term>, share: f32, lobe: &Diffuse, opaque: Matrix) {
        let mut add = |turn: Turn, coefficient: Matrix, albedo: Vec3| {
            let lobe = Lobe::Diffuse(Diffuse { albedo, ..*lobe });
            match terms.iter_mut().find(|term| term.turn == turn && term.lobe == lobe && self.replaces()) {
                Some(alike) => alike.coefficient = alike.coefficient.plus(coefficient),
                None if albedo != Vec3::ZERO => terms.push(Term { coefficient, lobe, turn }),
                None => {}
            }
        };
        for by in 0..3 {
            let after = |c: usize| (c + by) % 3;
            match &self.matrix {
                Reradiation::Colours(matrix) => {
                    let diagonal = [0, 1, 2].map(|c| matrix[after(c)][c]);
                    add(Turn::by(by as u8), share * opaque, diagonal.into());
                }
                Reradiation::Full(matrix) => {
                    for (out, half) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                        let diagonal = [0, 1, 2].map(|c| matrix[2 * after(c) + out][2 * c + half]);
                        let mut rows = [[0.0; 2]; 2];
                        rows[out][half] = share;
                        let turn = if by == 0 { Turn::NONE } else { Turn::by(by as u8) };
                        add(turn, Matrix::new(rows), diagonal.into());
                    }
                }
            }
        }
    }

    /// The most that leaves beside what the lobes reflect, of each colour that arrives. None: the matrix replaces theirs.
    pub(crate) fn most(&self) -> Option<Vec3> {
        match &self.matrix {
            Reradiation::Colours(matrix) => Some(Vec3::from_array([0, 1, 2].map(|c| column(matrix, c)))),
            Reradiation::Full(_) => None,
        }
    }

    /// What of it cannot be, beside a base colour of at most `base`.
    pub(super) fn check(&self, base: Vec3) -> Result<(), String> {
        match &self.matrix {
            Reradiation::Colours(matrix) => self.check_colours(matrix, base),
            Reradiation::Full(matrix) => self.check_full(matrix),
        }
    }

    fn check_colours(&self, matrix: &[[f32; 3]; 3], base: Vec3) -> Result<(), String> {
        for (row, out) in matrix.iter().zip(COLOURS) {
            if let Some((entry, came)) = row.iter().zip(COLOURS).find(|(entry, _)| !is_amount(**entry)) {
                return Err(format!("its fluorescence {out}←{came} is {entry}; write a number from 0 up"));
            }
        }
        for (c, came) in COLOURS.into_iter().enumerate().filter(|_| !self.gain) {
            let (reradiated, reflected) = (column(matrix, c), base[c]);
            if reradiated + reflected > 1.0 + ROUNDING {
                return Err(format!(
                    "of {came} light its fluorescence sends out {reradiated} beside the {reflected} of its base colour, more than \
                     comes in; lower one of them, or say \"gain\": true if that is wanted"
                ));
            }
        }
        Ok(())
    }

    fn check_full(&self, matrix: &[[f32; 6]; 6]) -> Result<(), String> {
        let name = |i: usize| format!("{} {}", HALVES[i % 2], COLOURS[i / 2]);
        for (i, row) in matrix.iter().enumerate() {
            if let Some((j, entry)) = row.iter().enumerate().find(|(_, entry)| !is_amount(**entry)) {
                let (out, came) = (name(i), name(j));
                return Err(format!("its matrix {out}←{came} is {entry}; write a number from 0 up"));
            }
        }
        for (j, half) in (0..6).flat_map(|j| [(j, 0), (j, 1)]).filter(|_| !self.gain) {
            // The two halves are not parts of a whole: each is light of its own.
            let sent: f32 = (0..3).map(|c| matrix[2 * c + half][j]).sum();
            if sent > 1.0 + ROUNDING {
                return Err(format!(
                    "of {} light its matrix sends out {sent} in the {} half, more than comes in; lower it, or say \"gain\": true if \
                     that is wanted",
                    name(j),
                    HALVES[half]
                ));
            }
        }
        Ok(())
    }

    /// In words, for whoever asks what a material is.
    pub fn describe(&self) -> String {
        match &self.matrix {
            Reradiation::Colours(matrix) => {
                let rows = matrix.map(|row| row.map(|entry| entry.to_string()).join(" "));
                format!("re-radiates {}", rows.join(", "))
            }
            Reradiation::Full(_) => "a 6×6 matrix of its own".into(),
        }
    }
}

/// What leaves in all of light of one colour.
fn column(matrix: &[[f32; 3]; 3], c: usize) -> f32 {
    matrix.iter().map(|row| row[c]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Light;

    fn sent(fluorescence: &Fluorescence, opaque: Matrix, light: Light) -> Light {
        let lobe = Diffuse { albedo: Vec3::ZERO, two_sided: false, under: None };
        let mut terms = Vec::new();
        fluorescence.add_terms(&mut terms, 1.0, &lobe, opaque);
        terms
            .iter()
            .map(|term| term.after(light, term.lobe.bound()))
            .fold(Light::ZERO, |sum, part| sum + part)
    }

    #[test]
    fn terms_do_what_the_matrices_say() {
        let light = Light::new(Vec3::new(1.0, 2.0, 3.0), Vec3::new(5.0, 7.0, 11.0));
        let colours: [[f32; 3]; 3] =
            std::array::from_fn(|out| std::array::from_fn(|c| 0.01 * (1 + 3 * out + c) as f32));
        let opaque = Matrix::new([[0.3, 0.2], [0.7, 0.1]]);
        let after = |rgb: Vec3| Vec3::from_array(colours.map(|row| Vec3::from_array(row).dot(rgb)));
        let met = opaque * light;
        let difference = sent(&Fluorescence::colours(colours), opaque, light)
            + -1.0 * Light::new(after(met.invisible), after(met.visible));
        assert!(difference.colours().abs().max_element() < 1e-6, "{difference:?}");

        let full: [[f32; 6]; 6] =
            std::array::from_fn(|i| std::array::from_fn(|j| 0.01 * (1 + (6 * i + j) % 7) as f32));
        let component = |i: usize| [light.invisible, light.visible][i % 2][i / 2];
        let expected = full.map(|row| (0..6).map(|j| row[j] * component(j)).sum::<f32>());
        let found = sent(&Fluorescence::full(full), opaque, light);
        for (i, expected) in expected.into_iter().enumerate() {
            let found = [found.invisible, found.visible][i % 2][i / 2];
            assert!((found - expected).abs() < 1e-6, "{i}: {found}, {expected}");
        }
    }

    #[test]
    fn equal_entries_share_their_terms() {
        // Global illumination in eq. 17: each invisible half comes of itself, and each visible half of it.
        let full = std::array::from_fn(|i| {
            std::array::from_fn(|j| if j % 2 == 0 && j / 2 == i / 2 { 0.5 } else { 0.0 })
        });
        let lobe = Diffuse { albedo: Vec3::ONE, two_sided: true, under: None };
        let mut terms = Vec::new();
        Fluorescence::full(full).add_terms(&mut terms, 1.0, &lobe, Matrix::IDENTITY);
        let lobe = Lobe::Diffuse(Diffuse { albedo: Vec3::splat(0.5), ..lobe });
        assert_eq!(terms, [Term::new(Matrix::new([[1.0, 0.0], [1.0, 0.0]]), lobe)]);
    }

    #[test]
    fn what_sends_out_more_than_comes_in_is_refused_unless_it_is_wanted() {
        let dye = Fluorescence::dye([0.0, 0.25, 1.0], [0.0, 3.0, 1.0], 0.75);
        assert_eq!(dye.most(), Some(Vec3::new(0.0, 0.1875, 0.75)));
        assert!(dye.check(Vec3::splat(0.25)).is_ok());
        let refused = dye.check(Vec3::splat(0.3)).unwrap_err();
        assert!(refused.starts_with("of blue light its fluorescence sends out 0.75"), "{refused}");
        assert!(dye.with_gain().check(Vec3::splat(0.3)).is_ok());
        let mut full = [[0.0; 6]; 6];
        (full[3][4], full[1][4]) = (0.7, 0.4);
        let refused = Fluorescence::full(full).check(Vec3::ZERO).unwrap_err();
        assert!(
            refused.contains("of invisible blue light") && refused.contains("in the visible half"),
            "{refused}"
        );
        full[2][5] = -1.0;
        let refused = Fluorescence::full(full).check(Vec3::ZERO).unwrap_err();
        assert!(refused.contains("invisible green←visible blue is -1"), "{refused}");
    }
}
