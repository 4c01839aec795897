//! Looks at few pairs against looks at all.
#![allow(clippy::unwrap_used)]

use super::*;

/// The definition: sums over all pairs, and the median of all others.
fn plain(station: usize, sound: &[bool], pairs: &[PairAgreement]) -> Option<f64> {
    let sums = |of: usize, without: Option<usize>| {
        let own = pairs.iter().filter(|pair| pair.target == of || pair.source == of);
        own.filter(|pair| {
            let other = pair.target + pair.source - of;
            sound[other] && Some(other) != without
        })
        .fold((0, 0), |sums: Counts, pair| (sums.0 + pair.agreeing, sums.1 + pair.contradicting))
    };
    let others = (0..sound.len()).filter(|&other| other != station && sound[other]);
    let mut odds: Vec<f64> = others.filter_map(|other| odds_of(sums(other, Some(station)))).collect();
    let own = odds_of(sums(station, None))?;
    (odds.len() + 1 >= FEWEST_STATIONS).then(|| own / upper_median(&mut odds).max(USUAL))
}

#[test]
fn few_looks_say_what_all_pairs_say() {
    let number = |k: usize, most: usize| (((k * 7919 + 3) as f64 * 0.618_034).fract() * most as f64) as usize;
    for (count, reach) in [(4, 3), (7, 6), (60, 3), (90, 1)] {
        let mut pairs = Vec::new();
        for target in 0..count {
            for source in target + 1..count.min(target + 1 + reach) {
                let k = target * count + source;
                let wrong = if number(k, 9) == 0 { 400 } else { 3 };
                let (agreeing, contradicting) = (number(k + 1, 200), number(k + 2, wrong));
                pairs.push(PairAgreement { target, source, agreeing, contradicting });
            }
        }
        let mut sound = vec![true; count];
        let mut judges = Judges::new(sound.clone(), &pairs);
        for _ in 0..count / 2 {
            for station in 0..count {
                assert_eq!(judges.times_usual(station), plain(station, &sound, &pairs), "{station} of {count}");
            }
            let times = (0..count).filter(|&k| sound[k]).filter_map(|k| Some((k, plain(k, &sound, &pairs)?)));
            let worst = times.max_by(|a, b| a.1.total_cmp(&b.1));
            assert_eq!(judges.worst(), worst, "of {count}");
            let Some((worst, _)) = worst else { break };
            judges.remove(worst);
            sound[worst] = false;
        }
    }
}
