//! Regenerates every figure and number of the paper into a folder, with a page that shows them side by side.

mod book;
mod clock;
mod diagrams;
mod effort;
mod figure1;
mod figure4;
mod five_points;
mod images;
mod opengl;
mod plot;
mod race;
mod section;
mod wireframe;

use book::Book;
use clap::Parser;
use effort::Effort;
use halflight::error::{Error, Result};
use halflight::film::{check_writable, replace_file};
use opengl::OpenGl;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Regenerates every figure and number of the paper “Retro-rendering with vector-valued light” into a folder.
///
/// Writes index.html (open it) and figures.md with all pictures beside them, and numbers.json. For figure 4 a fixed-function
/// OpenGL is needed, which Debian's packages libegl1 and libgl1-mesa-dri bring (no display, no graphics card); without it the rest is made.
#[derive(Parser)]
#[command(name = "paper_figures", version)]
struct Arguments {
    /// Smaller and noisier, in about one minute of two idle cores instead of ten
    #[arg(long)]
    quick: bool,
    /// Where the files go
    #[arg(short, long, value_name = "FOLDER", default_value = "paper-figures")]
    output: PathBuf,
    /// Width of the pictures of figure 4 in pixels, those of figure 1 in proportion [default: 480, with --quick 240]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(32..=4096))]
    width: Option<u32>,
    /// Seconds on idle cores that each method has in figure 4 [default: 40, with --quick 6]
    #[arg(long, value_name = "S", value_parser = seconds)]
    seconds: Option<f64>,
    /// As if there were no OpenGL
    #[arg(long)]
    no_opengl: bool,
}

fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            let code = if error.use_stderr() { 2 } else { 0 };
            let _ = error.print();
            return ExitCode::from(code);
        }
    };
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("paper_figures: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

fn run(arguments: &Arguments) -> Result<()> {
    let begin = Instant::now();
    let folder = &arguments.output;
    let cannot = |e: std::io::Error| Error::Write { path: folder.clone(), reason: e.to_string() };
    std::fs::create_dir_all(folder).map_err(cannot)?;
    check_writable(&folder.join("index.html"))?;
    let effort = if arguments.quick { Effort::QUICK } else { Effort::FULL };
    let effort = arguments.width.map_or(effort, |width| effort.of_width(width));
    let effort = Effort { seconds: arguments.seconds.unwrap_or(effort.seconds), ..effort };
    let opengl = if arguments.no_opengl { Err("--no-opengl was given".into()) } else { OpenGl::open() };
    let mut book = Book { facts: Vec::new(), missing: Vec::new(), chapters: Vec::new() };
    if let Err(reason) = &opengl {
        book.missing.push(format!(
            "There is no OpenGL here: {reason}. Figure 4 (a) and (c) are missing, and our own picture of the five spot lights stands in as \
             reference. On Debian, `apt-get install {}` brings it.",
            opengl::PACKAGES
        ));
        eprintln!("no OpenGL: {reason}; `apt-get install {}` brings it", opengl::PACKAGES);
    }
    book.chapters.push(figure1::figure(folder, &effort)?);
    eprintln!("figures 2 and 3");
    book.chapters.extend(diagrams::figures(folder)?);
    book.chapters.push(figure4::figure(folder, &effort, opengl.as_ref().ok())?);
    book.chapters.push(figure1::matrices(folder)?);
    book.facts = facts(arguments, opengl.as_ref().ok(), begin);
    put(folder, "numbers.json", &book.json())?;
    put(folder, "figures.md", &book.markdown())?;
    put(folder, "index.html", &book.html())?;
    eprintln!("wrote {}", folder.join("index.html").display());
    Ok(())
}

fn facts(arguments: &Arguments, opengl: Option<&OpenGl>, begin: Instant) -> Vec<(String, String)> {
    let mut command = String::from("cargo run --release -p paper_figures --");
    command += if arguments.quick { " --quick" } else { "" };
    arguments.width.iter().for_each(|width| command += &format!(" --width {width}"));
    arguments.seconds.iter().for_each(|seconds| command += &format!(" --seconds {seconds}"));
    command += if arguments.no_opengl { " --no-opengl" } else { "" };
    let threads = rayon::current_num_threads();
    let facts = [
        ("program", format!("halflight {}", env!("CARGO_PKG_VERSION"))),
        ("command", command),
        ("OpenGL", opengl.map_or_else(|| "none".into(), OpenGl::describe)),
        ("time", format!("{:.0} s, {threads} threads", begin.elapsed().as_secs_f64())),
    ];
    facts.map(|(name, value)| (name.into(), value)).into()
}

/// Writes a text file into the folder.
fn put(folder: &Path, name: &str, text: &str) -> Result<()> {
    replace_file(&folder.join(name), |file| file.write_all(text.as_bytes()))
}

fn seconds(text: &str) -> std::result::Result<f64, String> {
    let value: Option<f64> = text.parse().ok().filter(|s| *s > 0.0 && *s <= 86_400.0);
    value.ok_or_else(|| "a number of seconds above 0, at most 86400".into())
}
