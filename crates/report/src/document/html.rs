//! A document as one HTML page: one file, no network.

use std::fmt::Write;

use super::table::{Column, Table};
use super::{Block, Document, Merit, Place, Section, shown};
use crate::figure::{Figure, escape};

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

impl Document {
    /// The page; whole, with styles and pictures in it.
    pub fn html(&self) -> String {
        let further_style = if self.for_print { PRINT } else { "" };
        let (title, lead) = (escape(&self.title), escape(&self.lead));
        let mut html = format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
             <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\
             <title>{title}</title><style>{STYLE}{further_style}</style></head><body><main><h1>{title}</h1><p class=\"lead\">{lead}</p>\n"
        );
        for section in self.sections.iter().filter(|section| section.is_shown(Place::Page)) {
            write_section(&mut html, section);
        }
        html.push_str("</main></body></html>\n");
        html
    }
}

fn write_section(html: &mut String, section: &Section) {
    if !section.title.is_empty() {
        let class = if section.new_sheet { " class=\"sheet\"" } else { "" };
        // Writing to a string can't fail.
        let _ = writeln!(html, "<h2{class}>{}</h2>", escape(&section.title));
    }
    for (block, _) in section.blocks.iter().filter(|(_, place)| *place != Place::Text) {
        write_block(html, block);
    }
}

fn write_block(html: &mut String, block: &Block) {
    // Writing to a string can't fail.
    let _ = match block {
        Block::Subtitle(title) => writeln!(html, "<h3>{}</h3>", escape(title)),
        Block::Paragraph(text) => writeln!(html, "<p>{}</p>", escape(text)),
        Block::Signature(text) => writeln!(html, "<p class=\"sign\">{}</p>", escape(text)),
        Block::Warnings(sentences) | Block::List(sentences) => {
            html.push_str("<ul>");
            let (sentences, rest) = shown(sentences, "sentences");
            for sentence in sentences.iter().chain(&rest) {
                let _ = write!(html, "<li>{}</li>", escape(sentence));
            }
            writeln!(html, "</ul>")
        }
        Block::Merits(merits) => {
            writeln!(html, "<div class=\"cards\">{}</div>", merits.iter().map(card).collect::<String>())
        }
        Block::Figures(figures) => {
            let figures: String = figures.iter().map(figure).collect();
            writeln!(html, "<div class=\"figures\">{figures}</div>")
        }
        Block::Table(table) => {
            write_table(html, table);
            Ok(())
        }
    };
}

/// A figure of merit, large.
fn card(merit: &Merit) -> String {
    format!("<div class=\"card\"><b>{}</b><span>{}</span></div>", escape(&merit.value), escape(&merit.name))
}

fn figure(figure: &Figure) -> String {
    let caption = match figure.caption.as_str() {
        "" => String::new(),
        caption => format!("<figcaption>{}</figcaption>", escape(caption)),
    };
    format!("<figure>{}{caption}</figure>\n", figure.svg)
}

fn write_table(html: &mut String, table: &Table) {
    let words: Vec<bool> = (0..table.columns.len()).map(|column| table.is_of_words(column)).collect();
    let class = |column: usize| if words.get(column) == Some(&true) { " class=\"w\"" } else { "" };
    html.push_str("<table><thead><tr>");
    for (column, head) in table.columns.iter().map(Column::head).enumerate() {
        let _ = write!(html, "<th{}>{}</th>", class(column), escape(&head));
    }
    html.push_str("</tr></thead>\n<tbody>");
    let (rows, rest) = shown(&table.rows, "rows");
    for row in rows {
        html.push_str("<tr>");
        for (column, cell) in row.iter().enumerate() {
            let _ = write!(html, "<td{}>{}</td>", class(column), escape(cell));
        }
        html.push_str("</tr>\n");
    }
    html.push_str("</tbody></table>\n");
    if let Some(rest) = rest {
        let _ = writeln!(html, "<p>{rest}</p>");
    }
}
