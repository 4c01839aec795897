//! `--shard I/N` as it is typed.

use pipeline::Part;

/// One of several parts.
pub(crate) fn part(text: &str) -> Result<Part, String> {
    let numbers = text.split_once('/').and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
    match numbers {
        Some((number, of)) if (1..=of).contains(&number) => Ok(Part { number, of }),
        _ => Err("expected a part and the number of parts, such as 1/8 to 8/8".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_count_from_one() {
        assert_eq!(part("3/8"), Ok(Part { number: 3, of: 8 }));
        for bad in ["0/4", "5/4", "1", "a/b", "1/0", "/", "-1/4", "1/4/2"] {
            assert!(part(bad).is_err(), "{bad}");
        }
    }
}
