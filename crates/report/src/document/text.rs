//! A document as plain text: what a terminal shows.

use std::fmt;

use super::table::{Column, Table};
use super::{Block, Document, Place, Section, shown};

/// Between two columns.
const GAP: &str = "  ";

impl fmt::Display for Document {
    /// Plain text without figures, and without a line break at the end.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.title)?;
        if !self.lead.is_empty() {
            write!(f, "\n{}", self.lead)?;
        }
        self.sections
            .iter()
            .filter(|section| section.is_shown(Place::Text))
            .try_for_each(|section| write_section(f, section))
    }
}

fn write_section(f: &mut fmt::Formatter<'_>, section: &Section) -> fmt::Result {
    let only_warnings = section.blocks.iter().all(|(block, _)| matches!(block, Block::Warnings(_)));
    // Warnings say in each line what they are.
    match section.title.as_str() {
        _ if only_warnings => {}
        "" if section.is_opening => {}
        "" => writeln!(f)?,
        title => write!(f, "\n\n{title}")?,
    }
    let shown = section.blocks.iter().filter(|(block, place)| *place != Place::Page && block.has_text());
    shown.map(|(block, _)| block).try_for_each(|block| write_block(f, block))
}

fn write_block(f: &mut fmt::Formatter<'_>, block: &Block) -> fmt::Result {
    match block {
        Block::Subtitle(text) => write!(f, "\n\n{text}"),
        Block::Paragraph(text) | Block::Signature(text) => write!(f, "\n{text}"),
        Block::List(sentences) => write_sentences(f, "- ", sentences),
        Block::Warnings(sentences) => write_sentences(f, "doubt: ", sentences),
        Block::Merits(merits) => merits.iter().try_for_each(|merit| write!(f, "\n{}: {}", merit.name, merit.value)),
        Block::Table(table) => write_table(f, table),
        Block::Figures(_) => Ok(()),
    }
}

fn write_sentences(f: &mut fmt::Formatter<'_>, before: &str, sentences: &[String]) -> fmt::Result {
    let (sentences, rest) = shown(sentences, "sentences");
    sentences.iter().chain(&rest).try_for_each(|sentence| write!(f, "\n{before}{sentence}"))
}

fn write_table(f: &mut fmt::Formatter<'_>, table: &Table) -> fmt::Result {
    let head: Vec<String> = table.columns.iter().map(Column::head).collect();
    let (rows, rest) = shown(&table.rows, "rows");
    let lines = || std::iter::once(&head).chain(rows);
    let columns: Vec<(usize, bool)> = (0..head.len())
        .map(|column| {
            let width = lines().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max();
            (width.unwrap_or(0), table.is_of_words(column))
        })
        .collect();
    for row in lines() {
        let cells = row.iter().zip(&columns).map(|(cell, (width, is_of_words))| {
            if *is_of_words { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
        });
        write!(f, "\n{}", cells.collect::<Vec<_>>().join(GAP).trim_end())?;
    }
    rest.map_or(Ok(()), |rest| write!(f, "\n{rest}"))
}
