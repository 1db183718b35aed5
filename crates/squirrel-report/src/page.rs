//! The page: headings, tables and drawings in one HTML file that needs nothing else.

use super::chart::{Ink, Svg, escape};

const STYLE: &str =
    concat!(include_str!("colours.css"), include_str!("charts.css"), include_str!("page.css"));
const SCRIPT: &str = include_str!("page.js");

/// How many figures stand side by side on a wide screen; narrow screens take fewer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Columns {
    /// One, as wide as the page.
    One,
    /// Two.
    Two,
    /// Three.
    Three,
}

impl Columns {
    /// Width of a drawing that fills a column of a wide screen at its natural size, px.
    pub fn width(self) -> f64 {
        match self {
            Self::One => 1160.0,
            Self::Two => 570.0,
            Self::Three => 375.0,
        }
    }
}

/// Drawings under one heading with one caption.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figure {
    /// Heading.
    pub title: String,
    /// A sentence on what to look for; empty for none.
    pub caption: String,
    /// Drawings, one below the other.
    pub drawings: Vec<Svg>,
    /// What is missing, and why.
    pub notes: Vec<String>,
}

/// A row of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Colour before the first cell, the same as in the charts.
    pub ink: Option<Ink>,
    /// Cells.
    pub cells: Vec<String>,
}

/// A question with its answer, the number that matters, and plain sentences.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Card {
    /// Question, a few words.
    pub question: String,
    /// Answer in a few words.
    pub answer: String,
    /// The number that matters, with its unit; empty where there is none.
    pub figure: String,
    /// What the number is.
    pub figure_note: String,
    /// Plain sentences.
    pub sentences: Vec<String>,
}

/// A page under construction.
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    title: String,
    body: String,
    /// Style sheets and scripts beyond those of every page.
    styles: Vec<&'static str>,
    scripts: Vec<&'static str>,
}

impl Page {
    /// A page with a title and a lead text, which may be empty.
    pub fn new(title: &str, lead: &str) -> Self {
        let (styles, scripts) = (Vec::new(), Vec::new());
        let mut page = Self { title: title.to_owned(), body: String::new(), styles, scripts };
        page.add(&format!("<h1>{}</h1>\n", escape(title)));
        page.paragraph("lead", lead);
        page
    }

    /// Adds names and their values, such as the vehicle and the seed.
    pub fn facts(&mut self, facts: &[(String, String)]) {
        if facts.is_empty() {
            return;
        }
        self.add("<dl>\n");
        for (name, value) in facts {
            self.add(&format!("<div><dt>{}</dt><dd>{}</dd></div>\n", escape(name), escape(value)));
        }
        self.add("</dl>\n");
    }

    /// Begins a section with a heading and a text, which may be empty.
    pub fn section(&mut self, title: &str, text: &str) {
        self.add(&format!("<h2>{}</h2>\n", escape(title)));
        self.paragraph("say", text);
    }

    /// Adds a section that can be linked to, with a heading and a text, filled by `fill`.
    pub fn panel(&mut self, id: &str, title: &str, text: &str, fill: impl FnOnce(&mut Self)) {
        self.add(&format!("<section id=\"{}\">\n", escape(id)));
        self.section(title, text);
        fill(self);
        self.add("</section>\n");
    }

    /// Adds a paragraph.
    pub fn text(&mut self, text: &str) {
        self.paragraph("text", text);
    }

    /// Says what is missing, and why.
    pub fn missing(&mut self, text: &str) {
        self.paragraph("missing", text);
    }

    /// Adds text whose lines stay as they are.
    pub fn preformatted(&mut self, text: &str) {
        self.add(&format!("<pre>{}</pre>\n", escape(text)));
    }

    /// Adds a table; a row shorter than the head is filled with dashes.
    pub fn table(&mut self, head: &[String], rows: &[Row]) {
        self.add("<div class=\"wide\"><table>\n<thead><tr>");
        for cell in head {
            self.add(&format!("<th>{}</th>", escape(cell)));
        }
        self.add("</tr></thead>\n<tbody>\n");
        for row in rows {
            self.add("<tr>");
            for i in 0..head.len() {
                let text = row.cells.get(i).map_or("\u{2013}", |c| c.as_str());
                let swatch = row.ink.filter(|_| i == 0).map_or(String::new(), |ink| {
                    format!("<i class=\"swatch {}\"></i>", ink.class())
                });
                self.add(&format!("<td>{swatch}{}</td>", escape(text)));
            }
            self.add("</tr>\n");
        }
        self.add("</tbody></table></div>\n");
    }

    /// Adds figures side by side.
    pub fn figures(&mut self, columns: Columns, figures: &[Figure]) {
        let class = match columns {
            Columns::One => "one",
            Columns::Two => "two",
            Columns::Three => "three",
        };
        self.add(&format!("<div class=\"figures {class}\">\n"));
        for figure in figures {
            self.add(&format!("<figure>\n<h3>{}</h3>\n", escape(&figure.title)));
            for drawing in &figure.drawings {
                self.add(drawing.as_str());
            }
            for note in &figure.notes {
                self.paragraph("missing", note);
            }
            if !figure.caption.is_empty() {
                self.add(&format!("<figcaption>{}</figcaption>\n", escape(&figure.caption)));
            }
            self.add("</figure>\n");
        }
        self.add("</div>\n");
    }

    /// Adds a section of numbered questions with figures beside them, made to fit the first screen,
    /// with remarks below.
    pub fn cards(&mut self, id: &str, cards: &[Card], figures: &[Figure], remarks: &[String]) {
        self.add(&format!(
            "<section id=\"{}\">\n<div class=\"screen\">\n<ol class=\"cards\">\n",
            escape(id)
        ));
        for card in cards {
            let [question, answer] = [&card.question, &card.answer].map(|text| escape(text));
            self.add(&format!(
                "<li>\n<div>\n<h2>{question}</h2>\n<p class=\"answer\">{answer}</p>\n"
            ));
            for sentence in &card.sentences {
                self.paragraph("say", sentence);
            }
            self.add("</div>\n");
            if !card.figure.is_empty() {
                let [figure, note] = [&card.figure, &card.figure_note].map(|text| escape(text));
                self.add(&format!("<p class=\"number\"><strong>{figure}</strong>{note}</p>\n"));
            }
            self.add("</li>\n");
        }
        self.add("</ol>\n<div>\n");
        if !figures.is_empty() {
            self.figures(Columns::One, figures);
        }
        for remark in remarks {
            self.paragraph("remark", remark);
        }
        self.add("</div>\n</div>\n</section>\n");
    }

    /// The finished file.
    pub fn html(&self) -> String {
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{}</title>\n<style>\n{STYLE}{}</style>\n</head>\n<body>\n<main>\n{}</main>\n\
             <script>\n{SCRIPT}{}</script>\n</body>\n</html>\n",
            escape(&self.title),
            self.styles.concat(),
            self.body,
            self.scripts.concat()
        )
    }

    /// Adds a style sheet and a script of a kind of page.
    pub(crate) fn needs(&mut self, style: &'static str, script: &'static str) {
        self.styles.push(style);
        self.scripts.push(script);
    }

    /// Adds markup that is already safe.
    pub(crate) fn add(&mut self, markup: &str) {
        self.body.push_str(markup);
    }

    fn paragraph(&mut self, class: &str, text: &str) {
        if !text.is_empty() {
            self.add(&format!("<p class=\"{class}\">{}</p>\n", escape(text)));
        }
    }
}
