//! IES files: luminous intensity as laboratories write it down, ANSI/IES LM-63 in its versions of 1986 to 2019.

use super::web::Web;
use glam::Mat3;

/// What a file says: intensity (cd) about a pole, and the axes of the web in the space of a lamp that shines along −z: where its
/// turn begins, where it is 90°, and its pole.
pub(super) struct Photometry {
    pub web: Web,
    pub axes: Mat3,
}

/// Angles of one kind that a file may have: 0.2° apart.
const MOST_ANGLES: usize = 1024;

/// Lines of a lamp's tilt, which says how its power changes with how it hangs.
const MOST_TILTS: usize = 1024;

const ALONG_X: Mat3 = Mat3::from_cols_array(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0]);
const ALONG_Y: Mat3 = Mat3::from_cols_array(&[0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);

/// Angles, and for each of them a column of intensity.
struct Columns {
    angles: Vec<f64>,
    values: Vec<Vec<f64>>,
}

/// Reads the bytes of a file. Err: what is wrong with it.
pub(super) fn parse(bytes: &[u8]) -> Result<Photometry, String> {
    let text = String::from_utf8_lossy(bytes);
    let mut lines = text.split(['\n', '\r']);
    let is_tilt =
        |line: &&str| line.trim_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case("TILT="));
    let tilt = lines.find(is_tilt).ok_or("has no line TILT=, so it is no IES file; download it again")?;
    let mut numbers =
        Numbers(lines.flat_map(|line| line.split([' ', '\t', ','])).filter(|word| !word.is_empty()));
    if tilt.trim().to_ascii_uppercase().ends_with("INCLUDE") {
        numbers.next("tilt")?;
        let pairs = numbers.count("number of tilt angles", 0, MOST_TILTS)?;
        numbers.many("tilt", 2 * pairs)?;
    }
    numbers.many("lamps", 2)?;
    let factor = numbers.amount("multiplier")?;
    let vertical = numbers.count("number of vertical angles", 2, MOST_ANGLES)?;
    let horizontal = numbers.count("number of horizontal angles", 1, MOST_ANGLES)?;
    let kind = numbers.count("photometric type", 1, 3)?;
    numbers.many("size", 4)?;
    let factor = factor * numbers.amount("ballast factor")?;
    numbers.many("watts", 2)?;
    let vertical = numbers.many("vertical angles", vertical)?;
    let angles = numbers.many("horizontal angles", horizontal)?;
    let column =
        |_: &f64| vertical.iter().map(|_| numbers.amount("intensity").map(|value| factor * value)).collect();
    let values = angles.iter().map(column).collect::<Result<_, String>>()?;
    let columns = Columns { angles, values };
    match kind {
        1 => about_vertical(&vertical, columns),
        2 => about_horizontal(vertical, columns),
        _ => Err("is photometry of type A, as of headlights; only types B and C are read".into()),
    }
}

/// Type C: the pole is where the lamp shines, and turns are counted from x to y.
fn about_vertical(polar: &[f64], columns: Columns) -> Result<Photometry, String> {
    check_within("vertical", polar, [0.0, 180.0])?;
    let all = all_around(columns)?;
    Ok(Photometry { web: Web::new(polar, &all.angles, &all.values)?, axes: ALONG_X })
}

/// Type B: the pole lies across, on y; turns are the vertical angles, from where the lamp shines to x.
fn about_horizontal(vertical: Vec<f64>, columns: Columns) -> Result<Photometry, String> {
    check_within("vertical", &vertical, [-90.0, 90.0])?;
    check_within("horizontal", &columns.angles, [-90.0, 90.0])?;
    let across = both_sides(columns);
    let row = |i: usize| across.values.iter().map(|column| column[i]).collect();
    let values = (0..vertical.len()).map(row).collect();
    let turns = both_sides(Columns { angles: vertical, values });
    let polar: Vec<f64> = across.angles.iter().map(|angle| 90.0 + angle).collect();
    Ok(Photometry { web: Web::new(&polar, &turns.angles, &turns.values)?, axes: ALONG_Y })
}

fn check_within(what: &str, angles: &[f64], [least, most]: [f64; 2]) -> Result<(), String> {
    match angles.iter().find(|angle| !(least..=most).contains(*angle)) {
        Some(wrong) => Err(format!("its {what} angle {wrong} is not from {least} to {most}°; mend it")),
        None => Ok(()),
    }
}

/// All turns from those that are there: one stands for all, a quarter or a half has a mirror.
fn all_around(mut columns: Columns) -> Result<Columns, String> {
    let angles = &columns.angles;
    let (first, last) = (angles[0], angles[angles.len() - 1]);
    if angles.len() == 1 {
        let value = columns.values.remove(0);
        return Ok(Columns { angles: vec![0.0, 360.0], values: vec![value.clone(), value] });
    }
    // Some leave out the last, which is as the first.
    let gap = 360.0 - last;
    if last > 180.0
        && gap > 0.0
        && [angles[1] - first, last - angles[angles.len() - 2]].contains(&gap)
        && first == 0.0
    {
        columns.angles.push(360.0);
        columns.values.push(columns.values[0].clone());
        return Ok(columns);
    }
    match [first, last] {
        [0.0, 360.0] => Ok(columns),
        [0.0, 180.0] | [90.0, 270.0] => Ok(and_mirrored(columns)),
        [0.0, 90.0] => Ok(and_mirrored(and_mirrored(columns))),
        _ => Err(format!(
            "its horizontal angles go from {first} to {last}°; they go from 0 to 0, 90, 180 or 360, or from 90 to 270"
        )),
    }
}

/// With what a mirror at the last angle shows.
fn and_mirrored(mut columns: Columns) -> Columns {
    let count = columns.angles.len();
    let last = columns.angles[count - 1];
    for i in (0..count - 1).rev() {
        columns.angles.push(2.0 * last - columns.angles[i]);
        columns.values.push(columns.values[i].clone());
    }
    columns
}

/// With what a mirror at 0 shows, where angles begin there.
fn both_sides(Columns { angles, values }: Columns) -> Columns {
    if angles[0] != 0.0 {
        return Columns { angles, values };
    }
    let turned = Columns {
        angles: angles.iter().rev().map(|angle| -angle).collect(),
        values: values.into_iter().rev().collect(),
    };
    and_mirrored(turned)
}

/// The numbers of a file, one after another.
struct Numbers<I>(I);

impl<'a, I: Iterator<Item = &'a str>> Numbers<I> {
    /// A finite number; `what` is what messages call it.
    fn next(&mut self, what: &str) -> Result<f64, String> {
        let word = self.0.next().ok_or_else(|| format!("ends before its {what}; download it again"))?;
        let shown = || word.chars().take(40).collect::<String>();
        let number = word.parse().ok().filter(|x: &f64| x.is_finite());
        number.ok_or_else(|| format!("has `{}` in place of its {what}; mend it", shown()))
    }

    fn many(&mut self, what: &str, count: usize) -> Result<Vec<f64>, String> {
        (0..count).map(|_| self.next(what)).collect()
    }

    /// Not negative.
    fn amount(&mut self, what: &str) -> Result<f64, String> {
        let number = self.next(what)?;
        if number >= 0.0 { Ok(number) } else { Err(format!("its {what} is {number}; it is 0 or more")) }
    }

    fn count(&mut self, what: &str, least: usize, most: usize) -> Result<usize, String> {
        let number = self.next(what)?;
        let whole = number.fract() == 0.0 && (least as f64..=most as f64).contains(&number);
        if whole {
            Ok(number as usize)
        } else {
            Err(format!("its {what} is {number}; it is from {least} to {most}"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn file(head: &str, rest: &str) -> String {
        format!("IESNA:LM-63-2002\n[TEST] x\n[MANUFAC] Ümläut\n{head}\n{rest}")
    }

    /// What shines in a direction of the lamp's own space, cd.
    fn at(photometry: &Photometry, to: Vec3) -> f64 {
        let local = photometry.axes.transpose() * to.normalize();
        photometry.web.at(local.to_array().map(f64::from)) * photometry.web.mean()
    }

    fn good(rest: &str) -> Photometry {
        parse(file("TILT=NONE", rest).as_bytes()).unwrap_or_else(|e| panic!("{e}"))
    }

    #[track_caller]
    fn is(photometry: &Photometry, places: &[([f32; 3], f64)]) {
        for (to, expected) in places {
            let found = at(photometry, Vec3::from_array(*to));
            assert!((found - expected).abs() < 1e-4 * expected.max(1.0), "{to:?}: {found} for {expected}");
        }
    }

    #[test]
    fn one_horizontal_angle_stands_for_all_and_factors_multiply() {
        // Multiplier 2, ballast factor 0.5, a last field that is no factor.
        let lamp = good("1 -1 2 3 1 1 2 0 0 0\n0.5 1.10001 60\n0 45 90\n0\n30, 20 1e1\n");
        is(
            &lamp,
            &[
                ([0.0, 0.0, -1.0], 30.0),
                ([1.0, 0.0, -1.0], 20.0),
                ([0.0, -1.0, -1.0], 20.0),
                ([0.0, 0.0, 1.0], 0.0),
            ],
        );
    }

    #[test]
    fn quarters_and_halves_are_mirrored() {
        let lamp = |turns: &str, values: &str| {
            let count = turns.split(' ').count();
            good(&format!("1 -1 1 2 {count} 1 2 0 0 0 1 1 60 0 180 {turns} {values}"))
        };
        // Intensity at ±x and ±y, on the horizon half way between 0 and 180°.
        let flat = |x: f64, y: f64, nx: f64, ny: f64| {
            [([1.0, 0.0, 0.0], x), ([0.0, 1.0, 0.0], y), ([-1.0, 0.0, 0.0], nx), ([0.0, -1.0, 0.0], ny)]
        };
        is(&lamp("0 90", "1 1 3 3"), &flat(1.0, 3.0, 1.0, 3.0));
        is(&lamp("0 90 180", "1 1 3 3 5 5"), &flat(1.0, 3.0, 5.0, 3.0));
        is(&lamp("90 180 270", "1 1 3 3 5 5"), &flat(3.0, 1.0, 3.0, 5.0));
        is(&lamp("0 90 180 270 360", "1 1 3 3 5 5 7 7 1 1"), &flat(1.0, 3.0, 5.0, 7.0));
        is(&lamp("0 90 180 270", "1 1 3 3 5 5 7 7"), &flat(1.0, 3.0, 5.0, 7.0));
    }

    #[test]
    fn type_b_has_its_pole_across() {
        // Three vertical angles for each of two horizontal ones, which have a mirror.
        let lamp = good("1 -1 1 3 2 2 2 0 0 0 1 1 60 -90 0 90 0 90 2 4 6 1 1 1");
        is(&lamp, &[([0.0, 0.0, -1.0], 4.0), ([1.0, 0.0, 0.0], 6.0), ([-1.0, 0.0, 0.0], 2.0)]);
        is(&lamp, &[([0.0, 1.0, -1.0], 2.5), ([0.0, -1.0, -1.0], 2.5), ([0.0, 0.0, 1.0], 0.0)]);
        // Horizontal angles go to −y: clockwise.
        let aside = good("1 -1 1 2 3 2 2 0 0 0 1 1 60 -90 90 -90 0 90 1 1 4 4 9 9");
        is(&aside, &[([0.0, -1.0, -1.0], 6.5), ([0.0, 1.0, -1.0], 2.5)]);
    }

    #[test]
    fn a_tilt_is_passed_over() {
        let rest = "1 -1 1 2 1 1 2 0 0 0 1 1 60 0 180 0 5 5";
        let text = file("TILT=INCLUDE", &format!("1\n3\n0 90 180\n1 .9 .8\n{rest}"));
        let lamp = parse(text.as_bytes()).unwrap_or_else(|e| panic!("{e}"));
        is(&lamp, &[([0.0, 0.0, -1.0], 5.0)]);
    }

    #[test]
    fn what_is_wrong_with_a_file_is_told() {
        let good = "1 -1 1 2 1 1 2 0 0 0 1 1 60 0 90 0 5 5";
        assert!(parse(file("TILT=NONE", good).as_bytes()).is_ok());
        for (rest, word) in [
            ("", "ends before its lamps"),
            ("1 -1 1 2 1 1 2 0 0 0 1 1 60 0 90 0 5", "ends before its intensity"),
            ("1 -1 1 2 1 1 2 0 0 0 1 1 60 0 90 0 5 x", "`x` in place of its intensity"),
            ("1 -1 1 2 1 1 2 0 0 0 1 1 60 0 90 0 5 -5", "its intensity is -5"),
            ("1 -1 1 2 1 1 2 0 0 0 1 1 60 0 90 0 5 nan", "`nan` in place"),
            ("1 -1 1 2 1 1 2 0 0 0 1 1 60 0 90 0 0 0", "shines in no direction"),
            ("1 -1 1 1 1 1 2 0 0 0 1 1 60 0 0 5", "number of vertical angles is 1"),
            ("1 -1 1 1e9 1 1 2 0 0 0 1 1 60 0 0 5", "number of vertical angles is 1000000000"),
            ("1 -1 1 2 0.5 1 2 0 0 0 1 1 60 0 90 0 5 5", "number of horizontal angles is 0.5"),
            ("1 -1 1 2 1 3 2 0 0 0 1 1 60 0 90 0 5 5", "type A"),
            ("1 -1 1 2 1 4 2 0 0 0 1 1 60 0 90 0 5 5", "photometric type is 4"),
            ("1 -1 1 2 1 1 2 0 0 0 1 1 60 0 270 0 5 5", "vertical angle 270"),
            ("1 -1 1 2 1 1 2 0 0 0 1 1 60 90 0 0 5 5", "do not ascend"),
            ("1 -1 1 2 2 1 2 0 0 0 1 1 60 0 90 0 45 5 5 5 5", "from 0 to 45°"),
            ("1 -1 1 2 2 2 2 0 0 0 1 1 60 0 90 0 180 5 5 5 5", "horizontal angle 180"),
        ] {
            let why =
                parse(file("TILT=NONE", rest).as_bytes()).err().unwrap_or_else(|| panic!("{rest} is read"));
            assert!(why.contains(word) && !why.contains('\n'), "{rest}: {why}");
        }
        assert!(parse(b"hello").is_err_and(|why| why.contains("no line TILT=")));
        assert!(parse(b"\xff\xfeTILT").is_err());
    }
}
