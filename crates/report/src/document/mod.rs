//! Documents: sections with paragraphs, tables and figures.

mod html;
mod table;
mod text;

use std::fmt::Display;

pub use table::{Alignment, Column, Table, millimetres, rounded};

use crate::figure::Figure;

/// Rows of a table, and sentences of a list, that pages and texts show: of a survey of 100,000 frames a page of all would be tens of
/// megabytes, and nobody reads on. How many are left out is said; `summary.json` has all.
pub const MOST_ROWS: usize = 1000;

/// What is shown of rows, and what to say of the rest.
fn shown<'a, T>(rows: &'a [T], what: &str) -> (&'a [T], Option<String>) {
    let rest = rows.len().saturating_sub(MOST_ROWS);
    let words = (rest > 0).then(|| format!("{rest} further {what} are not shown; the files of the result have all."));
    (&rows[..rows.len() - rest], words)
}

/// A result for people, said once: [`Document::html`] makes a page of it, its `Display` plain text.
///
/// It grows section by section: what is added belongs to the section that was begun last.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Document {
    title: String,
    lead: String,
    for_print: bool,
    sections: Vec<Section>,
}

/// A part with a title of its own; the first of a document has none.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Section {
    title: String,
    /// Of a document, before any section was begun.
    is_opening: bool,
    new_sheet: bool,
    blocks: Vec<(Block, Place)>,
}

/// Where a block is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// On the page and in the text.
    Both,
    /// On the page alone: explanations, and tables too long for a terminal.
    Page,
    /// In the text alone: what only who started the work needs to know, such as where files went.
    Text,
}

/// What stands in a section.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Block {
    /// The title of what follows.
    Subtitle(String),
    /// Sentences.
    Paragraph(String),
    /// Sentences one below the other.
    List(Vec<String>),
    /// What speaks against the result.
    Warnings(Vec<String>),
    /// Figures of merit.
    Merits(Vec<Merit>),
    /// A table.
    Table(Table),
    /// Figures side by side; text has none.
    Figures(Vec<Figure>),
    /// A line to sign on.
    Signature(String),
}

/// A figure of merit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Merit {
    value: String,
    name: String,
}

impl Merit {
    /// A value with its unit, and what it is.
    pub fn new(value: impl Into<String>, name: impl Into<String>) -> Self {
        Self { value: value.into(), name: name.into() }
    }
}

impl<V: Into<String>, N: Into<String>> From<(V, N)> for Merit {
    fn from((value, name): (V, N)) -> Self {
        Self::new(value, name)
    }
}

impl Block {
    fn has_text(&self) -> bool {
        !matches!(self, Self::Figures(_))
    }
}

impl Section {
    /// Whether anything of it is shown there.
    fn is_shown(&self, place: Place) -> bool {
        let hidden = if place == Place::Page { Place::Text } else { Place::Page };
        let shown = |(block, at): &(Block, Place)| *at != hidden && (place == Place::Page || block.has_text());
        self.blocks.iter().any(shown)
    }
}

impl Document {
    /// A document without sections. `lead` says in a sentence what it is of.
    pub fn new(title: impl Into<String>, lead: impl Into<String>) -> Self {
        let (title, lead) = (title.into(), lead.into());
        Self { title, lead, for_print: false, sections: vec![Section { is_opening: true, ..Section::default() }] }
    }

    /// A document whose page is made to be printed on A4.
    pub fn for_print(title: impl Into<String>, lead: impl Into<String>) -> Self {
        Self { for_print: true, ..Self::new(title, lead) }
    }

    /// Begins a section. One in which nothing is put is not shown.
    pub fn section(&mut self, title: impl Into<String>) {
        self.sections.push(Section { title: title.into(), ..Section::default() });
    }

    /// Begins a section on a new sheet of a page that is printed.
    pub fn sheet(&mut self, title: impl Into<String>) {
        self.sections.push(Section { title: title.into(), new_sheet: true, ..Section::default() });
    }

    /// Adds a block, shown where `place` says.
    pub fn add(&mut self, block: Block, place: Place) {
        if let Some(section) = self.sections.last_mut() {
            section.blocks.push((block, place));
        }
    }

    /// The title of what follows in the section.
    pub fn subsection(&mut self, title: impl Into<String>) {
        self.add(Block::Subtitle(title.into()), Place::Both);
    }

    /// Sentences.
    pub fn paragraph(&mut self, text: impl Into<String>) {
        self.add(Block::Paragraph(text.into()), Place::Both);
    }

    /// Sentences that explain what the page shows.
    pub fn explanation(&mut self, text: impl Into<String>) {
        self.add(Block::Paragraph(text.into()), Place::Page);
    }

    /// Sentences for who reads the text.
    pub fn remark(&mut self, text: impl Into<String>) {
        self.add(Block::Paragraph(text.into()), Place::Text);
    }

    /// The last words of the text: where files went.
    pub fn closing(&mut self, text: impl Into<String>) {
        self.section("");
        self.remark(text);
    }

    /// Sentences one below the other; none: nothing.
    pub fn list<T: Display>(&mut self, sentences: &[T]) {
        if !sentences.is_empty() {
            self.add(Block::List(sentences.iter().map(ToString::to_string).collect()), Place::Both);
        }
    }

    /// What speaks against the result, as a section of its own; none: nothing.
    pub fn warnings<T: Display>(&mut self, sentences: &[T]) {
        if !sentences.is_empty() {
            self.section("Before you use it");
            self.add(Block::Warnings(sentences.iter().map(ToString::to_string).collect()), Place::Both);
        }
    }

    /// Figures of merit, large on the page.
    pub fn merits<M: Into<Merit>>(&mut self, merits: impl IntoIterator<Item = M>) {
        self.add(Block::Merits(merits.into_iter().map(Into::into).collect()), Place::Both);
    }

    /// A table; see [`Column`] for what stands in its head.
    pub fn table<C: Into<Column>>(&mut self, columns: impl IntoIterator<Item = C>, rows: Vec<Vec<String>>) {
        self.add(Block::Table(Table::new(columns, rows)), Place::Both);
    }

    /// A table that only the page has.
    pub fn long_table<C: Into<Column>>(&mut self, columns: impl IntoIterator<Item = C>, rows: Vec<Vec<String>>) {
        self.add(Block::Table(Table::new(columns, rows)), Place::Page);
    }

    /// Figures side by side, also as pairs with their captions; none: nothing.
    pub fn figures<F: Into<Figure>>(&mut self, figures: impl IntoIterator<Item = F>) {
        let figures: Vec<Figure> = figures.into_iter().map(Into::into).collect();
        if !figures.is_empty() {
            self.add(Block::Figures(figures), Place::Page);
        }
    }

    /// A line to sign on.
    pub fn signature(&mut self, text: impl Into<String>) {
        self.add(Block::Signature(text.into()), Place::Page);
    }
}
