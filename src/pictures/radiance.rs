//! Radiance pictures (`.hdr`): four bytes a pixel, three mantissas and a common exponent.
//!
//! The format is that of G. Ward, "Real pixels", Graphics Gems II, 1991, and of the Radiance file format document.

/// A decoded Radiance picture.
pub(crate) struct Radiance {
    pub width: u32,
    pub height: u32,
    /// Mantissas of red, green and blue, and the exponent: the channel is mantissa · 2^(exponent − 136) times `scale`, zero where
    /// the exponent is zero. Row by row from the top left.
    pub pixels: Vec<[u8; 4]>,
    /// From what is stored to radiance: one over the exposures and colour corrections that the header names.
    pub scale: [f32; 3],
}

/// A header longer than this is none.
const LONGEST_HEADER: usize = 1 << 16;
/// Widths of rows that the newer encoding is for.
const ENCODED_WIDTHS: std::ops::RangeInclusive<usize> = 8..=0x7FFF;

impl Radiance {
    /// True where the bytes begin as such a file does.
    pub fn begins(bytes: &[u8]) -> bool {
        bytes.starts_with(b"#?RADIANCE") || bytes.starts_with(b"#?RGBE")
    }

    /// Decodes a file of at most so many pixels. Err: why not.
    pub fn decode(bytes: &[u8], most: u64) -> Result<Self, String> {
        let mut rest = bytes;
        let scale = header(&mut rest)?;
        let layout = Layout::read(line(&mut rest)?)?;
        let [rows, columns] = layout.lengths;
        let count = u64::from(rows) * u64::from(columns);
        if count > most {
            return Err(format!("{}x{} pixels are too many", layout.width(), layout.height()));
        }
        if 4 * u64::from(rows) > rest.len() as u64 {
            return Err("damaged: its header announces more rows than it can hold".into());
        }
        let mut pixels = Vec::new();
        pixels.try_reserve_exact(count as usize).map_err(|_| "it takes more memory than there is")?;
        for _ in 0..rows {
            row(&mut rest, columns as usize, &mut pixels)?;
        }
        let (width, height) = (layout.width(), layout.height());
        Ok(Self { width, height, pixels: layout.upright(pixels), scale })
    }
}

/// The next line without its end.
fn line<'a>(rest: &mut &'a [u8]) -> Result<&'a str, String> {
    let end = rest.iter().take(LONGEST_HEADER).position(|byte| *byte == b'\n');
    let (line, after) = rest.split_at(end.ok_or("damaged: its header does not end")?);
    *rest = &after[1..];
    let line = std::str::from_utf8(line).map_err(|_| "damaged: its header is no text")?;
    Ok(line.trim_end_matches('\r'))
}

/// Goes through the header, and gives what pixels are to be multiplied by.
fn header(rest: &mut &[u8]) -> Result<[f32; 3], String> {
    let mut scale = [1.0_f64; 3];
    let length = rest.len();
    loop {
        let line = line(rest)?;
        if length - rest.len() > LONGEST_HEADER {
            return Err("damaged: its header does not end".into());
        }
        let Some((key, value)) = line.split_once('=') else {
            if line.is_empty() {
                return Ok(scale.map(|x| x as f32));
            }
            continue;
        };
        let value = value.trim();
        match key.trim() {
            "FORMAT" if value != "32-bit_rle_rgbe" => {
                return Err(format!("its format is {}; only 32-bit_rle_rgbe is read", shown(value)));
            }
            "EXPOSURE" => {
                let [by] = numbers(key, value)?;
                scale = scale.map(|x| x / by);
            }
            "COLORCORR" => {
                let by: [f64; 3] = numbers(key, value)?;
                scale = std::array::from_fn(|c| scale[c] / by[c]);
            }
            "GAMMA" if numbers::<1>(key, value)? != [1.0] => {
                return Err(format!("its {} is not linear light; save it with a gamma of 1", shown(line)));
            }
            _ => {}
        }
    }
}

/// Numbers above zero.
fn numbers<const N: usize>(key: &str, value: &str) -> Result<[f64; N], String> {
    let read = |word: &str| word.parse::<f64>().ok().filter(|x| *x > 0.0 && x.is_finite());
    let all: Option<Vec<f64>> = value.split_whitespace().map(read).collect();
    let wrong = || format!("damaged: its {key} is {}, not {N} numbers above zero", shown(value));
    all.and_then(|all| all.try_into().ok()).ok_or_else(wrong)
}

fn shown(text: &str) -> String {
    text.chars().take(60).map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// In which order pixels are stored.
struct Layout {
    /// How many rows are stored one after the other, and how many pixels each has.
    lengths: [u32; 2],
    /// Those rows are columns of the picture.
    columns: bool,
    /// Along them, from one to the next and from pixel to pixel: true where it runs to the left or upward.
    backward: [bool; 2],
}

impl Layout {
    /// From the line that ends the header, as `-Y 512 +X 1024`.
    fn read(line: &str) -> Result<Self, String> {
        let wrong = || format!("damaged: `{}` is no size, as -Y 512 +X 1024", shown(line));
        let words: Vec<&str> = line.split_whitespace().collect();
        let &[first, rows, second, columns] = &words[..] else { return Err(wrong()) };
        let length = |word: &str| word.parse::<u32>().ok().filter(|n| *n > 0).ok_or_else(wrong);
        // Upward is +Y and leftward is −X.
        let backward = |axis: &str| match axis {
            "-Y" | "+X" => Ok(false),
            "+Y" | "-X" => Ok(true),
            _ => Err(wrong()),
        };
        let is_y = |axis: &str| axis.ends_with('Y');
        if is_y(first) == is_y(second) {
            return Err(wrong());
        }
        Ok(Self {
            lengths: [length(rows)?, length(columns)?],
            columns: !is_y(first),
            backward: [backward(first)?, backward(second)?],
        })
    }

    fn width(&self) -> u32 {
        self.lengths[usize::from(!self.columns)]
    }

    fn height(&self) -> u32 {
        self.lengths[usize::from(self.columns)]
    }

    /// The same pixels row by row from the top left.
    fn upright(&self, stored: Vec<[u8; 4]>) -> Vec<[u8; 4]> {
        if !self.columns && self.backward == [false; 2] {
            return stored;
        }
        let [rows, columns] = self.lengths.map(|length| length as usize);
        let along = |i: usize, axis: usize| {
            let length = [rows, columns][axis];
            if self.backward[axis] { length - 1 - i } else { i }
        };
        let pixel = |(y, x): (usize, usize)| {
            let (row, column) = if self.columns { (x, y) } else { (y, x) };
            stored[along(row, 0) * columns + along(column, 1)]
        };
        let places =
            (0..self.height() as usize).flat_map(|y| (0..self.width() as usize).map(move |x| (y, x)));
        places.map(pixel).collect()
    }
}

/// Decodes a row.
fn row(rest: &mut &[u8], width: usize, pixels: &mut Vec<[u8; 4]>) -> Result<(), String> {
    let start: [u8; 4] = take(rest)?;
    let announced = usize::from(start[2]) << 8 | usize::from(start[3]);
    let encoded = ENCODED_WIDTHS.contains(&width) && start[..2] == [2, 2] && start[2] < 0x80;
    if !encoded {
        return old_row(start, rest, width, pixels);
    }
    if announced != width {
        return Err(format!("damaged: a row of {announced} pixels where it has {width}"));
    }
    let begin = pixels.len();
    pixels.resize(begin + width, [0; 4]);
    (0..4).try_for_each(|channel| channel_of(rest, &mut pixels[begin..], channel))
}

/// Runs and plain bytes of one channel.
fn channel_of(rest: &mut &[u8], row: &mut [[u8; 4]], channel: usize) -> Result<(), String> {
    let mut at = 0;
    while at < row.len() {
        let [count] = take(rest)?;
        let (count, run) = if count > 128 { (count - 128, true) } else { (count, false) };
        let count = usize::from(count);
        if count == 0 || count > row.len() - at {
            return Err("damaged: a run of pixels passes the end of its row".into());
        }
        if run {
            let [byte] = take(rest)?;
            row[at..at + count].iter_mut().for_each(|pixel| pixel[channel] = byte);
        } else {
            let (bytes, after) = rest.split_at_checked(count).ok_or(SHORT)?;
            row[at..at + count].iter_mut().zip(bytes).for_each(|(pixel, byte)| pixel[channel] = *byte);
            *rest = after;
        }
        at += count;
    }
    Ok(())
}

/// Whole pixels; one of mantissas 1, 1, 1 says how often the last is repeated, several in turn in bytes from the lowest.
fn old_row(first: [u8; 4], rest: &mut &[u8], width: usize, pixels: &mut Vec<[u8; 4]>) -> Result<(), String> {
    let begin = pixels.len();
    let end = begin + width;
    let mut shift = 0;
    let mut next = first;
    loop {
        if let [1, 1, 1, count] = next {
            let count = usize::from(count).checked_shl(shift).filter(|count| *count <= end - pixels.len());
            let last = pixels[begin..].last().copied();
            let (Some(count), Some(last)) = (count, last) else {
                return Err("damaged: a run of pixels passes the end of its row".into());
            };
            pixels.extend(std::iter::repeat_n(last, count));
            shift += 8;
        } else {
            pixels.push(next);
            shift = 0;
        }
        if pixels.len() == end {
            return Ok(());
        }
        next = take(rest)?;
    }
}

const SHORT: &str = "damaged: it ends early";

fn take<const N: usize>(rest: &mut &[u8]) -> Result<[u8; N], String> {
    let (taken, after) = rest.split_first_chunk::<N>().ok_or(SHORT)?;
    *rest = after;
    Ok(*taken)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, size: &str, pixels: &[u8]) -> Vec<u8> {
        [format!("#?RADIANCE\n{header}\n{size}\n").as_bytes(), pixels].concat()
    }

    fn pixels(header: &str, size: &str, bytes: &[u8]) -> Result<Vec<[u8; 4]>, String> {
        Radiance::decode(&file(header, size, bytes), 1 << 20).map(|picture| picture.pixels)
    }

    #[test]
    fn flat_old_and_new_rows_are_read() {
        let flat: Vec<u8> = (0..24).map(|i| 10 + i).collect();
        let six: Vec<[u8; 4]> = flat.as_chunks::<4>().0.to_vec();
        assert_eq!(pixels("", "-Y 2 +X 3", &flat), Ok(six));
        // Three of a kind and then 256 + 1 more, by two runs in turn.
        let old = [9, 8, 7, 130, 1, 1, 1, 2, 5, 5, 5, 131, 1, 1, 1, 1, 1, 1, 1, 1];
        let expected = [vec![[9, 8, 7, 130]; 3], vec![[5, 5, 5, 131]; 258]].concat();
        assert_eq!(pixels("", "-Y 1 +X 261", &old), Ok(expected));
        let new =
            [&[2, 2, 0, 8][..], &[136, 40], &[3, 1, 2, 3, 133, 9], &[8, 0, 1, 2, 3, 4, 5, 6, 7], &[136, 129]]
                .concat();
        let green = [1, 2, 3, 9, 9, 9, 9, 9];
        let expected: Vec<[u8; 4]> = (0..8).map(|i| [40, green[i], i as u8, 129]).collect();
        assert_eq!(pixels("", "-Y 1 +X 8", &new), Ok(expected));
    }

    #[test]
    fn every_orientation_comes_out_upright() {
        let [a, b, c, d, e, f] = [[10; 4], [20; 4], [30; 4], [40; 4], [50; 4], [60; 4]];
        let stored = [a, b, c, d, e, f].concat();
        let read = |size: &str| {
            let picture = Radiance::decode(&file("", size, &stored), 100).expect(size);
            (picture.width, picture.height, picture.pixels)
        };
        assert_eq!(read("-Y 2 +X 3"), (3, 2, vec![a, b, c, d, e, f]));
        assert_eq!(read("+Y 2 +X 3"), (3, 2, vec![d, e, f, a, b, c]));
        assert_eq!(read("-Y 2 -X 3"), (3, 2, vec![c, b, a, f, e, d]));
        assert_eq!(read("+X 3 -Y 2"), (3, 2, vec![a, c, e, b, d, f]));
        assert_eq!(read("-X 3 +Y 2"), (3, 2, vec![f, d, b, e, c, a]));
    }

    #[test]
    fn exposures_and_corrections_add_up_and_what_cannot_be_followed_is_named() {
        let picture = |header: &str| Radiance::decode(&file(header, "-Y 1 +X 1", &[1, 2, 3, 4]), 100);
        let header = "EXPOSURE=2\nsoftware = x\nCOLORCORR= 1 2 4\nEXPOSURE= 0.25\nGAMMA=1\nPRIMARIES=0 0 0 0 0 0 0 0\n";
        assert_eq!(picture(header).map(|picture| picture.scale), Ok([2.0, 1.0, 0.5]));
        for (header, word) in [
            ("FORMAT=32-bit_rle_xyze\n", "32-bit_rle_xyze"),
            ("GAMMA=2.2\n", "GAMMA=2.2"),
            ("EXPOSURE=0\n", "EXPOSURE is 0"),
            ("COLORCORR=1 1\n", "COLORCORR"),
        ] {
            let why = picture(header).map(|picture| picture.scale).expect_err(header);
            assert!(why.contains(word), "{why}");
        }
    }

    #[test]
    fn damaged_files_are_errors() {
        let new = [2, 2, 0, 8];
        let with = |rest: &[u8]| [&new[..], rest].concat();
        for (size, bytes, word) in [
            ("-Y 1 +X 0", vec![0; 4], "no size"),
            ("-Y 1 -Y 1", vec![0; 4], "no size"),
            ("-Y 1", vec![0; 4], "no size"),
            ("-Y 9 +X 9", vec![0; 30], "more rows"),
            ("-Y 1 +X 2", vec![7; 6], "ends early"),
            ("-Y 2000 +X 2000", vec![0; 99], "too many"),
            ("-Y 1 +X 8", with(&[0]), "passes the end"),
            ("-Y 1 +X 8", with(&[200, 1]), "passes the end"),
            ("-Y 1 +X 8", with(&[4, 1, 1]), "ends early"),
            ("-Y 1 +X 9", with(&[137, 1]), "a row of 8"),
            ("-Y 1 +X 3", vec![1; 4], "passes the end"),
            ("-Y 1 +X 3", vec![2, 2, 2, 2, 1, 1, 1, 9], "passes the end"),
        ] {
            let why = pixels("", size, &bytes).expect_err(size);
            assert!(why.contains(word), "{size}: {why}");
        }
        assert!(Radiance::decode(b"#?RADIANCE\n", 9).is_err_and(|why| why.contains("does not end")));
        assert!(Radiance::begins(b"#?RGBE\n") && !Radiance::begins(b"#?"));
    }
}
