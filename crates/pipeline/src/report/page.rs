//! The page around the figures: one file, no network.

use std::fmt::{Display, Write};

use super::picture::escape;
use crate::verdict::Doubt;

const STYLE: &str = "
body{font:15px/1.5 system-ui,sans-serif;color:#1c2430;background:#f6f7f9;margin:0}
main{max-width:1256px;margin:0 auto;padding:24px}
h1{font-size:26px;margin:0 0 4px}h2{font-size:19px;margin:32px 0 8px;border-bottom:1px solid #d5dae1;padding-bottom:4px}
h3{font-size:15px;margin:18px 0 6px}
p.lead{margin:0 0 12px;color:#55606e}
.figures{display:flex;flex-wrap:wrap;gap:14px;margin-bottom:14px;align-items:flex-start}
figure{margin:0;background:#fff;border:1px solid #dde2e8;border-radius:6px;padding:10px}
figcaption{font-size:12px;color:#55606e;width:0;min-width:100%;margin-top:4px}
svg{max-width:100%;height:auto;display:block}
svg .title{font:600 13px system-ui,sans-serif;fill:#1c2430}svg .tick{font:10px system-ui,sans-serif;fill:#444}
table{border-collapse:collapse;background:#fff;border:1px solid #dde2e8;font-variant-numeric:tabular-nums}
td,th{padding:4px 12px;text-align:right;border-bottom:1px solid #eceff3}th{font-weight:600;background:#f0f2f5}
td:first-child,th:first-child,td.w,th.w{text-align:left}
.cards{display:flex;flex-wrap:wrap;gap:12px;margin:12px 0}
.card{background:#fff;border:1px solid #dde2e8;border-radius:6px;padding:10px 16px;min-width:120px}
.card b{display:block;font-size:21px}.card span{font-size:12px;color:#55606e}
.bar{display:inline-block;height:10px;background:#3b6ea5;border-radius:2px;vertical-align:middle}
";

/// What a page for paper has besides: A4, black on white, tables that go on with their head on the next sheet.
const PRINT: &str = "
@page{size:A4;margin:18mm 16mm 20mm}
body{font:10.5pt/1.4 Georgia,serif;color:#000;background:#fff}main{max-width:178mm;padding:6mm 0}
p.lead{color:#000}h1{font-size:18pt}h2{font-size:13pt;margin:18pt 0 5pt;border-color:#000;break-after:avoid}
table{font-size:8.5pt;width:100%;border-color:#000}td,th{padding:2px 5px;border-bottom:1px solid #bbb;overflow-wrap:anywhere}
th{background:#fff;border-bottom:1px solid #000}thead{display:table-header-group}tr{break-inside:avoid}
h2.sheet{break-before:page}p.sign{margin-top:16mm;border-top:1px solid #000;width:80mm;break-inside:avoid}
";

/// A page that grows section by section.
pub(crate) struct Page {
    html: String,
}

impl Page {
    pub(crate) fn new(title: &str, lead: &str) -> Self {
        Self::styled(title, lead, "")
    }

    /// A page that is made to be printed on A4.
    pub(crate) fn for_print(title: &str, lead: &str) -> Self {
        Self::styled(title, lead, PRINT)
    }

    fn styled(title: &str, lead: &str, further_style: &str) -> Self {
        let title = escape(title);
        let html = format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
             <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\
             <title>{title}</title><style>{STYLE}{further_style}</style></head><body><main><h1>{title}</h1><p class=\"lead\">{}</p>\n",
            escape(lead)
        );
        Self { html }
    }

    pub(crate) fn section(&mut self, title: &str) {
        let _ = writeln!(self.html, "<h2>{}</h2>", escape(title));
    }

    /// A section that begins a new sheet of a page that is printed.
    pub(crate) fn sheet(&mut self, title: &str) {
        let _ = writeln!(self.html, "<h2 class=\"sheet\">{}</h2>", escape(title));
    }

    /// A line to sign on.
    pub(crate) fn signature(&mut self, text: &str) {
        let _ = writeln!(self.html, "<p class=\"sign\">{}</p>", escape(text));
    }

    pub(crate) fn subsection(&mut self, title: &str) {
        let _ = writeln!(self.html, "<h3>{}</h3>", escape(title));
    }

    pub(crate) fn paragraph(&mut self, text: &str) {
        let _ = writeln!(self.html, "<p>{}</p>", escape(text));
    }

    /// Sentences one below the other.
    pub(crate) fn list<T: Display>(&mut self, sentences: &[T]) {
        if sentences.is_empty() {
            return;
        }
        self.html.push_str("<ul>");
        for sentence in sentences {
            let _ = write!(self.html, "<li>{}</li>", escape(&sentence.to_string()));
        }
        self.html.push_str("</ul>\n");
    }

    /// What speaks against the result, where anything does.
    pub(crate) fn doubts(&mut self, doubts: &[Doubt]) {
        if !doubts.is_empty() {
            self.section("Before you use it");
            self.list(doubts);
        }
    }

    /// Figures side by side, each with a caption.
    pub(crate) fn figures(&mut self, figures: &[(String, String)]) {
        self.html.push_str("<div class=\"figures\">");
        for (svg, caption) in figures {
            let caption = if caption.is_empty() {
                String::new()
            } else {
                format!("<figcaption>{}</figcaption>", escape(caption))
            };
            let _ = writeln!(self.html, "<figure>{svg}{caption}</figure>");
        }
        self.html.push_str("</div>\n");
    }

    /// Figures of merit, large.
    pub(crate) fn cards(&mut self, cards: &[(String, String)]) {
        self.html.push_str("<div class=\"cards\">");
        for (value, name) in cards {
            let _ =
                write!(self.html, "<div class=\"card\"><b>{}</b><span>{}</span></div>", escape(value), escape(name));
        }
        self.html.push_str("</div>\n");
    }

    /// A table; columns of words are set to the left, those of numbers to the right.
    pub(crate) fn table(&mut self, head: &[&str], rows: &[Vec<String>]) {
        let words: Vec<bool> = (0..head.len()).map(|column| rows.iter().any(|row| is_word(row.get(column)))).collect();
        let class = |column: usize| if words.get(column) == Some(&true) { " class=\"w\"" } else { "" };
        self.html.push_str("<table><thead><tr>");
        for (column, cell) in head.iter().enumerate() {
            let _ = write!(self.html, "<th{}>{}</th>", class(column), escape(cell));
        }
        self.html.push_str("</tr></thead>\n<tbody>");
        for row in rows {
            self.html.push_str("<tr>");
            for (column, cell) in row.iter().enumerate() {
                let _ = write!(self.html, "<td{}>{}</td>", class(column), escape(cell));
            }
            self.html.push_str("</tr>\n");
        }
        self.html.push_str("</tbody></table>\n");
    }

    pub(crate) fn finish(mut self) -> String {
        self.html.push_str("</main></body></html>\n");
        self.html
    }
}

/// Whether a cell is words rather than a number with its unit.
fn is_word(cell: Option<&String>) -> bool {
    cell.is_some_and(|cell| {
        let letters = cell.chars().filter(|c| c.is_alphabetic()).count();
        let digits = cell.chars().filter(char::is_ascii_digit).count();
        cell.chars().next().is_some_and(char::is_alphabetic) || letters > digits
    })
}
