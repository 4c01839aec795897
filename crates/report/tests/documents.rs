use report::{Block, Column, Document, Merit, Place, Table, rounded};

fn document() -> Document {
    let mut document = Document::new("A <wall>", "Of 3 m.");
    document.merits(vec![Merit::new("1.2 mm", "rms")]);
    document.warnings(&["not yet warm"]);
    document.section("Residuals");
    document.explanation("What drifts is not warm.");
    document.table(
        [Column::words("station"), Column::number("rms").unit("mm")],
        vec![vec!["left of the door".into(), "1.2".into()], vec!["S2".into(), "10.3".into()]],
    );
    document.section("Nothing in it");
    document.remark("written to out");
    document
}

#[test]
fn text_has_every_fact_in_aligned_columns_and_no_explanations() {
    let expected = "A <wall>\nOf 3 m.\nrms: 1.2 mm\ndoubt: not yet warm\n\nResiduals\nstation           rms (mm)\n\
                    left of the door       1.2\nS2                    10.3\n\nNothing in it\nwritten to out";
    assert_eq!(document().to_string(), expected);
}

#[test]
fn a_page_is_one_file_with_escaped_words_and_units_in_its_heads() {
    let html = document().html();
    assert!(html.starts_with("<!doctype html>") && html.ends_with("</html>\n"));
    for part in [
        "<h1>A &lt;wall&gt;</h1>",
        "<h2>Before you use it</h2>\n<ul><li>not yet warm</li></ul>",
        "<th>rms (mm)</th>",
        "<td class=\"w\">left of the door</td><td>1.2</td>",
        "What drifts is not warm.",
    ] {
        assert!(html.contains(part), "{part} in {html}");
    }
    assert!(!html.contains("written to out") && !html.contains("Nothing in it") && !html.contains("http-equiv"));
}

#[test]
fn columns_of_headers_alone_stand_as_their_cells_ask() {
    let mut document = Document::new("t", "");
    let rows = vec![vec!["12 mm".to_owned(), "yes".to_owned()], vec!["-".to_owned(), "no".to_owned()]];
    document.add(Block::Table(Table::new(["length", "taken"], rows)), Place::Both);
    assert_eq!(document.to_string(), "t\nlength  taken\n 12 mm  yes\n     -  no");
    let printed = Document::for_print("t", "");
    assert!(printed.html().contains("@page"));
}

#[test]
fn what_rounds_to_zero_has_no_sign() {
    let cells = [-0.04, -0.05, -0.0, 0.0, -12.34].map(|value| rounded(value, 1));
    assert_eq!(cells, ["0.0", "-0.1", "0.0", "0.0", "-12.3"]);
    assert_eq!([rounded(-0.4, 0), rounded(f64::NAN, 1), rounded(f64::NEG_INFINITY, 1)], ["0", "NaN", "-inf"]);
}

#[test]
fn of_very_many_rows_it_is_said_how_many_are_left_out() {
    let mut document = Document::new("Long", "");
    let rows = (0..2500).map(|row| vec![format!("S{row}")]).collect();
    document.table([Column::words("station")], rows);
    document.warnings(&(0..1001).map(|doubt| format!("doubt {doubt}")).collect::<Vec<_>>());
    for text in [document.html(), document.to_string()] {
        assert!(text.contains("S999") && !text.contains("S1000"));
        assert!(text.contains("1500 further rows are not shown; the files of the result have all."));
        assert!(text.contains("doubt 999") && !text.contains("doubt 1000") && text.contains("1 further sentences"));
    }
}
