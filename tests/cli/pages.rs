//! The pages of the documentation, as a phone shows them, in light and in dark. They use the same style and script as pages made
//! now, which tests of the library check.

use crate::browser::chromium;
use crate::page::open;
use crate::support::skipped;
use crate::support::text;
use std::path::{Path, PathBuf};

/// Width of a phone's window, px.
const PHONE: u32 = 390;

/// Opens a page in a frame and writes what it finds into its own root.
const MEASURE: &str = r#"<!doctype html><iframe src="file://PAGE" width="WIDTH" height="800" style="border: 0"></iframe><script>
addEventListener("load", () => setTimeout(() => {
  const page = document.querySelector("iframe").contentDocument;
  const view = page.defaultView;
  let [smallest, words] = [Infinity, ""];
  const found = (size, text) => { if (size < smallest) [smallest, words] = [size, text.trim().slice(0, 40)]; };
  const texts = page.createTreeWalker(page.body, NodeFilter.SHOW_TEXT);
  for (let node = texts.nextNode(); node; node = texts.nextNode()) {
    const element = node.parentElement;
    if (!node.textContent.trim() || element.closest("script, style, title") || !element.checkVisibility()) continue;
    const scale = element.ownerSVGElement ? element.getScreenCTM().a : 1;
    found(scale * parseFloat(view.getComputedStyle(element).fontSize), node.textContent);
  }
  // Diagrams that are pictures have 13 px type.
  for (const image of page.querySelectorAll("img[src$='.svg']")) found(13 * image.clientWidth / image.naturalWidth, image.src);
  Object.assign(document.documentElement.dataset, { wide: page.documentElement.scrollWidth, smallest, words,
    ground: view.getComputedStyle(page.body).backgroundColor.match(/\d+/g).reduce((sum, c) => sum + Number(c), 0),
    lang: page.documentElement.lang });
}, 2000));
</script>"#;

/// What a page was found to be.
struct Found {
    /// Of the whole content, px.
    wide: u32,
    /// Size of the smallest words, px, and these.
    smallest: f64,
    words: String,
    /// Red + green + blue of the ground, each to 255.
    ground: u32,
    lang: String,
}

fn measured(browser: &Path, page: &Path, dark: bool) -> Found {
    let folder = tempfile::tempdir().expect("a folder");
    let frame = folder.path().join("frame.html");
    let html = MEASURE.replace("PAGE", text(page)).replace("WIDTH", &PHONE.to_string());
    std::fs::write(&frame, html).expect("written");
    let dom = open(browser, &frame, "", dark, &["--allow-file-access-from-files", "--dump-dom"]);
    let fact = |name: &str| -> String {
        let rest = dom
            .split(&format!("data-{name}=\""))
            .nth(1)
            .unwrap_or_else(|| panic!("{name} of {page:?}: {dom}"));
        rest.split('"').next().unwrap_or_default().to_owned()
    };
    let number = |name: &str| fact(name).parse::<f64>().expect("a number");
    Found {
        wide: number("wide") as u32,
        smallest: number("smallest"),
        words: fact("words"),
        ground: number("ground") as u32,
        lang: fact("lang"),
    }
}

fn pages() -> Vec<PathBuf> {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let single =
        ["stability/index.html", "square.html", "paper-figures/index.html"].map(|page| docs.join(page));
    let compared = std::fs::read_dir(docs.join("error-vs-time")).expect("a folder").flatten();
    let compared = compared.map(|entry| entry.path().join("compare.html")).filter(|page| page.exists());
    single.into_iter().chain(compared).collect()
}

#[test]
fn pages_fit_a_phone_with_legible_words_in_light_and_dark() {
    let Some(browser) = chromium() else {
        skipped("no Chromium here, so the pages of docs/ were not opened; install it or set CHROMIUM");
        return;
    };
    let pages = pages();
    assert!(pages.len() >= 8, "{pages:?}");
    for page in pages {
        for dark in [false, true] {
            let found = measured(&browser, &page, dark);
            assert!(found.wide <= PHONE, "{page:?} is {} px wide", found.wide);
            assert!(found.smallest >= 12.0, "{page:?}: {:?} of {} px", found.words, found.smallest);
            assert_eq!(found.lang, "en", "{page:?}");
            let (darkest, lightest) = if dark { (0, 150) } else { (600, 765) };
            assert!(
                (darkest..=lightest).contains(&found.ground),
                "{page:?}, dark {dark}: ground {}",
                found.ground
            );
        }
    }
}
