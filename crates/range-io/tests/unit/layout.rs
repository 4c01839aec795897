//! Lines of a RON text; a module of `src/text/ron_text/layout.rs`.

use super::*;

#[test]
fn short_text_stays_on_one_line() {
    assert_eq!(in_lines(r#"(a:1,b:"x, (:",c:[1,2],d:Name(1))"#), "(a: 1, b: \"x, (:\", c: [1, 2], d: Name(1))\n");
}

#[test]
fn long_lists_fill_lines() {
    let numbers = vec!["123.5"; 40].join(",");
    let text = in_lines(&format!("(a:[{numbers}],b:2)"));
    assert!(text.lines().all(|line| line.len() <= LONGEST_LINE), "{text}");
    assert_eq!(text.lines().count(), 8, "{text}");
    assert_eq!(text.replace([' ', '\n'], "").replace(",]", "]").replace(",)", ")"), format!("(a:[{numbers}],b:2)"));
}
