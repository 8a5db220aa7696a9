//! The results, figure by figure: the page, its text form and the numbers are all made from this.

use serde_json::{Map, Value, json};

/// Everything.
pub struct Book {
    /// What was run, on what: name and value.
    pub facts: Vec<(String, String)>,
    /// What could not be made, and what brings it.
    pub missing: Vec<String>,
    /// In the paper's order.
    pub chapters: Vec<Chapter>,
}

/// One figure of the paper.
pub struct Chapter {
    /// Its name in `numbers.json` and in links.
    pub key: &'static str,
    /// Heading.
    pub title: String,
    /// What the paper shows and says, in our own words.
    pub paper: String,
    /// What was made here.
    pub here: Vec<String>,
    /// Pictures, row by row.
    pub strips: Vec<Strip>,
    /// Numbers.
    pub numbers: Vec<Number>,
    /// What there is to know about the numbers.
    pub notes: Vec<String>,
}

/// Pictures side by side.
pub struct Strip {
    /// Above them.
    pub title: String,
    /// From left to right.
    pub pictures: Vec<Picture>,
}

/// A file of the folder.
pub struct Picture {
    /// Its name.
    pub file: String,
    /// Below it.
    pub caption: String,
    /// True where pixels are meant to be seen.
    pub pixels: bool,
}

/// One figure, beside the paper's where it gives one.
pub struct Number {
    /// Its name in `numbers.json`.
    pub key: String,
    /// In words.
    pub what: String,
    /// The paper's.
    pub paper: &'static str,
    /// Ours, as people read it.
    pub here: String,
    /// Ours.
    pub value: f64,
}

impl Number {
    /// A number that the paper does not have.
    pub fn new(key: impl Into<String>, what: impl Into<String>, value: f64, here: String) -> Self {
        Self { key: key.into(), what: what.into(), paper: "", here, value }
    }

    /// What the paper says of it.
    pub fn beside(self, paper: &'static str) -> Self {
        Self { paper, ..self }
    }
}

impl Picture {
    /// A photograph, a drawing.
    pub fn new(file: impl Into<String>, caption: impl Into<String>) -> Self {
        Self { file: file.into(), caption: caption.into(), pixels: false }
    }

    /// Shown without smoothing.
    pub fn magnified(file: impl Into<String>, caption: impl Into<String>) -> Self {
        Self { pixels: true, ..Self::new(file, caption) }
    }
}

impl Strip {
    /// Some pictures.
    pub fn new(title: impl Into<String>, pictures: Vec<Picture>) -> Self {
        Self { title: title.into(), pictures }
    }
}

const CSS: &str = include_str!("page.css");
const TITLE: &str = "The figures of “Retro-rendering with vector-valued light”, made by halflight";

impl Book {
    /// One page; pictures lie beside it.
    pub fn html(&self) -> String {
        let mut text = format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
             content=\"width=device-width, initial-scale=1\">\n<title>{TITLE}</title>\n<style>\n{CSS}</style>\n</head>\n\
             <body>\n<header>\n<h1>{TITLE}</h1>\n<dl>\n"
        );
        for (name, value) in &self.facts {
            text += &format!("<div><dt>{}</dt><dd>{}</dd></div>\n", escape(name), escape(value));
        }
        text += "</dl>\n";
        for missing in &self.missing {
            text += &format!("<p class=\"missing\">{}</p>\n", escape(missing));
        }
        text += "<nav>\n";
        for chapter in &self.chapters {
            text += &format!("<a href=\"#{}\">{}</a>\n", chapter.key, escape(&chapter.title));
        }
        text += "</nav>\n</header>\n<main>\n";
        self.chapters.iter().for_each(|chapter| text += &chapter.html());
        text + "</main>\n</body>\n</html>\n"
    }

    /// The same as Markdown.
    pub fn markdown(&self) -> String {
        let mut text = format!("# {TITLE}\n\n| | |\n|---|---|\n");
        for (name, value) in &self.facts {
            text += &format!("| {name} | {} |\n", value.replace('|', "\\|"));
        }
        text += "\n";
        self.missing.iter().for_each(|missing| text += &format!("**{missing}**\n\n"));
        self.chapters.iter().for_each(|chapter| text += &chapter.markdown());
        text
    }

    /// Every number, by figure and name.
    pub fn json(&self) -> String {
        let mut figures = Map::new();
        for chapter in &self.chapters {
            let numbers = chapter.numbers.iter().map(|n| (n.key.clone(), json!(n.value)));
            figures.insert(chapter.key.into(), Value::Object(numbers.collect()));
        }
        let facts: Map<String, Value> = self.facts.iter().map(|(k, v)| (k.clone(), json!(v))).collect();
        let all = json!({ "facts": facts, "missing": self.missing, "figures": figures });
        serde_json::to_string_pretty(&all).expect("plain data") + "\n"
    }
}

impl Chapter {
    fn html(&self) -> String {
        let mut text = format!(
            "<section id=\"{}\">\n<h2>{}</h2>\n<p><b>The paper.</b> {}</p>\n",
            self.key,
            escape(&self.title),
            escape(&self.paper)
        );
        for (i, line) in self.here.iter().enumerate() {
            let head = if i == 0 { "<b>Here.</b> " } else { "" };
            text += &format!("<p>{head}{}</p>\n", escape(line));
        }
        for strip in &self.strips {
            text += &format!("<h3>{}</h3>\n<div class=\"strip\">\n", escape(&strip.title));
            for Picture { file, caption, pixels } in &strip.pictures {
                let class = if *pixels { " class=\"pixels\"" } else { "" };
                let caption = escape(caption);
                text += &format!(
                    "<figure><a href=\"{file}\"><img{class} src=\"{file}\" alt=\"{caption}\"></a><figcaption>{caption}</figcaption></figure>\n"
                );
            }
            text += "</div>\n";
        }
        if !self.numbers.is_empty() {
            text += "<div class=\"wide\"><table>\n<tr><th>number</th><th>paper</th><th>here</th></tr>\n";
            for Number { what, paper, here, .. } in &self.numbers {
                let cells = [what.as_str(), paper, here].map(escape);
                text +=
                    &format!("<tr><td>{}</td><td>{}</td><td>{}</td></tr>\n", cells[0], cells[1], cells[2]);
            }
            text += "</table></div>\n";
        }
        if !self.notes.is_empty() {
            text += "<ul class=\"notes\">\n";
            self.notes.iter().for_each(|note| text += &format!("<li>{}</li>\n", escape(note)));
            text += "</ul>\n";
        }
        text + "</section>\n"
    }

    fn markdown(&self) -> String {
        let mut text = format!("## {}\n\n**The paper.** {}\n\n", self.title, self.paper);
        for (i, line) in self.here.iter().enumerate() {
            text += &format!("{}{line}\n\n", if i == 0 { "**Here.** " } else { "" });
        }
        for Strip { title, pictures } in &self.strips {
            let row = |cell: &dyn Fn(&Picture) -> String| {
                format!("| {} |\n", pictures.iter().map(cell).collect::<Vec<_>>().join(" | "))
            };
            text += &format!("### {title}\n\n");
            text += &row(&|picture| format!("![{}]({})", picture.caption, picture.file));
            text += &row(&|_| "---".into());
            text += &row(&|picture| picture.caption.clone());
            text += "\n";
        }
        if !self.numbers.is_empty() {
            text += "| number | paper | here |\n|---|---|---|\n";
            for Number { what, paper, here, .. } in &self.numbers {
                text += &format!("| {what} | {paper} | {here} |\n");
            }
            text += "\n";
        }
        self.notes.iter().for_each(|note| text += &format!("- {note}\n"));
        text + "\n"
    }
}

/// Text for HTML and SVG.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
