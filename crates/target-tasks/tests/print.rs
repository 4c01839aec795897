//! Pages to be printed: what is on them, and what they do not replace.

use std::path::Path;

use target_tasks::targets::PaperSize;
use target_tasks::{PrintRequest, TargetKind, print_targets};

fn request(words: &str, out: &Path) -> PrintRequest {
    let kind = TargetKind::parse(&words.split(' ').collect::<Vec<_>>()).unwrap();
    PrintRequest { kind, paper: PaperSize::A4, codes: None, out: out.to_owned() }
}

#[test]
fn pages_say_what_they_are_and_what_near_infrared_makes_of_ink() {
    let folder = tempfile::tempdir().unwrap();
    let kinds = ["checkerboard 9x6 0.018", "circles 7x5 0.025 1.6", "asymmetric-circles 4x11 0.012", "rings 0.006"];
    for words in kinds {
        let out = folder.path().join("deep/page.svg");
        let printed = print_targets(&request(words, &out)).unwrap();
        let page = std::fs::read_to_string(&out).unwrap();
        assert!(page.starts_with("<svg") && page.contains(printed.infrared) && page.contains("100 mm"), "{words}");
        assert!(printed.to_string().contains("reflect like paper"), "{printed}");
        assert_eq!(printed.codes.len(), page.matches(">R").count(), "{words}");
        assert!(words.starts_with("rings") == (printed.codes.len() > 5), "{words}: {:?}", printed.codes);
    }
    let chosen = PrintRequest { codes: Some([3, 5]), ..request("rings 0.01", &folder.path().join("r.svg")) };
    assert_eq!(print_targets(&chosen).unwrap().codes, ["R003", "R004", "R005"]);
}

#[test]
fn other_files_are_not_replaced_and_what_cannot_be_printed_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let photograph = folder.path().join("board.svg");
    std::fs::write(&photograph, "<svg>a drawing of someone</svg>").unwrap();
    for (words, out, expected) in [
        ("checkerboard 9x6 0.018", photograph.as_path(), "no page of targets"),
        ("checkerboard 9x6 0.018", folder.path(), "is a folder"),
        ("checkerboard 9x6 0.05", &folder.path().join("a.svg"), "larger paper"),
        ("rings 0.1", &folder.path().join("a.svg"), "larger paper"),
        ("spheres 0.1", &folder.path().join("a.svg"), "spheres are not printed"),
    ] {
        let refused = print_targets(&request(words, out)).unwrap_err().to_string();
        assert!(refused.contains(expected), "{words}: {refused}");
    }
    let backwards = PrintRequest { codes: Some([9, 3]), ..request("rings 0.01", &folder.path().join("a.svg")) };
    assert!(print_targets(&backwards).unwrap_err().to_string().contains("codes 0 to 112"));
    assert_eq!(std::fs::read_to_string(&photograph).unwrap(), "<svg>a drawing of someone</svg>");
    assert!(!folder.path().join("a.svg").exists());
}
