//! The table of `halflight check` as one page: a section for each case, and an explanation of the columns.

use super::out::counted;
use crate::report::{escape, fill};
use crate::stability::LARGEST_Z;

/// One row of the table: the fields of [`super::check::COLUMNS`].
type Row = [String; 9];

/// The whole page; rows of one case follow each other.
pub fn page(rows: &[Row]) -> String {
    let cases: Vec<&[Row]> = rows.chunk_by(|a, b| a[0] == b[0]).collect();
    let values = [
        ("style", include_str!("check.css")),
        ("largest_z", &LARGEST_Z.to_string()),
        ("verdict", &verdict(&cases)),
        ("links", &cases.iter().map(|case| link(case)).collect::<String>()),
        ("sections", &cases.iter().map(|case| section(case)).collect::<String>()),
    ];
    fill(include_str!("check_page.html"), &values)
}

fn failed(row: &Row) -> bool {
    row[8] != "pass"
}

fn verdict(cases: &[&[Row]]) -> String {
    let rows = || cases.iter().flat_map(|case| case.iter());
    let seconds: f64 = cases.iter().filter_map(|case| case[0][7].parse::<f64>().ok()).sum();
    let failures = match rows().filter(|row| failed(row)).count() {
        0 => "<b class=\"pass\">all pass</b>".to_owned(),
        count => format!("<b class=\"FAIL\">{count} FAIL</b>"),
    };
    let [cases, rows] = [counted(cases.len(), "case"), counted(rows().count(), "row")];
    format!("{cases}, {rows}: {failures}. It took {seconds:.0} seconds of wall-clock time.")
}

fn link(case: &[Row]) -> String {
    let class = if case.iter().any(failed) { " class=\"FAIL\"" } else { "" };
    let name = escape(&case[0][0]);
    format!("<a{class} href=\"#{name}\">{name}</a>\n")
}

fn section(case: &[Row]) -> String {
    let [name, promise, _, _, _, _, _, seconds, _] = case[0].each_ref().map(|field| escape(field));
    let rows: String = case.iter().map(row).collect();
    format!(
        "<section id=\"{name}\">\n<h2>{name}</h2>\n<p>{promise} <span class=\"soft\">({seconds} s)</span></p>\n\
         <div class=\"wide\"><table>\n<thead><tr><th>what</th><th>expected</th><th>got</th>\
         <th>z</th><th>relative error</th><th>verdict</th></tr></thead>\n<tbody>\n{rows}</tbody>\n</table></div>\n</section>\n"
    )
}

fn row(row: &Row) -> String {
    let [_, _, what, expected, got, z, relative, _, verdict] = row.each_ref().map(|field| escape(field));
    let begins = if failed(row) { "<tr class=\"failed\">" } else { "<tr>" };
    // A fact has words, which may break; a number has a z.
    let number = if z.is_empty() { "" } else { " class=\"number\"" };
    let relative = relative.replace('-', "−");
    let cells = [
        ("expected", expected, number),
        ("got", got, number),
        ("z", z, number),
        ("relative error", relative, number),
    ];
    // A narrow page writes a value a line, each after its label.
    let cell = |(label, text, class): (&str, String, &str)| match text.as_str() {
        "" => "<td class=\"none\"></td>".to_owned(),
        text => format!("<td{class} data-label=\"{label}\">{text}</td>"),
    };
    let cells: String = cells.map(cell).concat();
    format!("{begins}<td>{what}</td>{cells}<td class=\"{verdict}\">{verdict}</td></tr>\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a table as `csv` writes it: every field quoted, no line break in one.
    fn parsed(table: &str) -> Vec<Row> {
        let fields = |line: &str| {
            let inner = line.strip_prefix('"').and_then(|line| line.strip_suffix('"')).expect("quoted");
            let fields: Vec<_> = inner.split("\",\"").map(|field| field.replace("\"\"", "\"")).collect();
            fields.try_into().expect("nine fields")
        };
        table.lines().skip(1).map(fields).collect()
    }

    #[test]
    fn a_failure_is_named_above_and_marked_in_its_row() {
        let row = |case: &str, verdict: &str| {
            [case, "a < b", "x", "1", "2 ± 0.1", "9.00", "-1.0e0", "1.25", verdict].map(str::to_owned)
        };
        let page = page(&[row("good", "pass"), row("bad", "pass"), row("bad", "FAIL")]);
        assert!(page.contains("2 cases, 3 rows: <b class=\"FAIL\">1 FAIL</b>. It took 2 seconds"), "{page}");
        assert!(
            page.contains("<a href=\"#good\">") && page.contains("<a class=\"FAIL\" href=\"#bad\">"),
            "{page}"
        );
        assert_eq!((page.matches("<tr class=\"failed\">").count(), page.matches("a &lt; b").count()), (1, 2));
        assert!(page.contains("below 3.5") && page.contains("−1.0e0") && !page.contains("{{"), "{page}");
    }

    /// `HALFLIGHT_REWRITE=1` makes the page of the documentation anew from its table.
    #[test]
    fn the_page_of_the_documentation_is_made_of_its_table() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/stability");
        let table = std::fs::read_to_string(folder.join("table.csv")).expect("the table");
        let (page, path) = (page(&parsed(&table)), folder.join("index.html"));
        if std::env::var_os("HALFLIGHT_REWRITE").is_some() {
            std::fs::write(&path, &page).expect("the page is written");
        }
        assert!(
            std::fs::read_to_string(&path).is_ok_and(|kept| kept == page),
            "{} is not of now",
            path.display()
        );
    }
}
