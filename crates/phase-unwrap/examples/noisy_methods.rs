//! dev
#![allow(clippy::print_stdout, missing_docs)]
#[path = "../tests/common/fringes.rs"]
mod fringes;
use fringes::*;
use phase_unwrap::*;
use std::time::Instant;

fn main() {
    let n = [320, 240];
    let seed: u64 = std::env::args().nth(1).and_then(|s| s.parse().ok()).unwrap_or(1);
    let objects = |c: f64, r: f64| -> f64 {
        let hash = |n: u32| f64::from(n.wrapping_mul(2_654_435_761).rotate_left(13).wrapping_mul(2_246_822_519)) / 2f64.powi(32);
        let mut d = 30.0 + 0.01 * c - 0.006 * r;
        for n in 0..30 {
            let [x, y, size, off] = [0, 1, 2, 3].map(|p| hash(4 * n + p));
            let (dx, dy) = ((c - 320.0 * x).abs(), (r - 240.0 * y).abs());
            let rad = 8.0 + 30.0 * size;
            if if n % 2 == 0 { dx.hypot(dy) < rad } else { dx.max(1.5 * dy) < rad } { d = 30.0 - 10.0 * off + 0.02 * (c - 320.0 * x); }
        }
        d
    };
    let holes = |c: f64, r: f64| if (c % 46.0 < 20.0) && (r % 34.0 < 15.0) { f64::NAN } else { 2.0 * c + 0.3 * r };
    let step = |c: f64, _: f64| if c > 160.0 { 1.9 * (c - 160.0) } else { 0.1 * (c - 160.0) };
    let boxes = |c: f64, r: f64| { let i = |l: f64, t: f64| (l..l + 23.0).contains(&c) && (t..t + 31.0).contains(&r);
        1.6 * c - 0.7 * r - [(10.0, 12.0, 1.5), (60.0, 9.0, 2.6), (131.0, 60.0, 2.0), (280.0, 155.0, 2.9)].iter().filter(|o| i(o.0, o.1)).map(|o| o.2).sum::<f64>() };
    let flatboxes = |c: f64, r: f64| { let i = |l: f64, t: f64| (l..l + 23.0).contains(&c) && (t..t + 31.0).contains(&r);
        0.03 * r - [(10.0, 12.0, 1.5), (60.0, 9.0, 2.6), (131.0, 60.0, 2.0), (280.0, 155.0, 2.9)].iter().filter(|o| i(o.0, o.1)).map(|o| o.2).sum::<f64>() };
    let smooth = |col: f64, row: f64| 40.0 + 0.11 * col + 0.05 * row - 0.000_25 * ((col - 330.0f64).powi(2) + (row - 210.0f64).powi(2));
    let egg = |c: f64, r: f64| 9.0 + 6.0 * (c / 5.0).sin() * (r / 6.0).cos();
    let bumps = |c: f64, r: f64| 3.0 + 0.1 * c + 9.0 * (-(((c % 40.0) - 20.0).powi(2) + ((r % 40.0) - 20.0).powi(2)) / 100.0).exp();
    let fence = |c: f64, r: f64| 20.0 + 0.03 * r + 0.8 * c - if c % 9.0 < 3.0 { 2.2 } else { 0.0 };
    let sphere = |c: f64, r: f64| { let q = 1.0 - ((c - 160.0) / 130.0).powi(2) - ((r - 120.0) / 130.0).powi(2); 3.0 + if q > 0.0 { 130.0 * q.sqrt() } else { 0.0 } };
    let sh = hill(2.9, [160.0, 120.0], 160.0);
    let os = |c: f64, r: f64| objects(c, r) + 1.7 * c + 0.9 * r;
    let r20 = ramp(2.0, 0.0); let r245 = ramp(2.0, 45.0); let r290 = ramp(2.0, 90.0); let r1 = ramp(1.0, 30.0); let r28 = ramp(2.8, 200.0);
    let h = hill(2.5, [150.0, 110.0], 200.0); let flat = |_: f64, _: f64| 3.0;
    let scenes: Vec<(&str, &Surface)> = vec![("flat", &flat), ("smooth", &smooth), ("ramp1@30", &r1), ("ramp2@0", &r20), ("ramp2@45", &r245), ("ramp2@90", &r290), ("ramp2.8@200", &r28),
        ("hill2.5", &h), ("boxes flat", &flatboxes), ("boxes steep", &boxes), ("holes", &holes), ("step", &step), ("objects", &objects),
        ("eggbox", &egg), ("bumps", &bumps), ("fence", &fence), ("sphere", &sphere), ("steep hill", &sh), ("objects steep", &os)];
    println!("{:14}{:>6}{:>9}{:>9}{:>9}{:>9}{:>9} | ms", "scene", "sigma", "tree", "cuts", "filter", "f+cuts", "auto");
    for (name, s) in scenes {
        for sigma in [0.05, 0.3, 0.5, 0.7, 1.0, 1.2, 1.4] {
            let f = Fringes::new(n, s, sigma, seed);
            let mut t = vec![]; let mut sh = vec![];
            let outs: Vec<_> = [NoisyMethod::Tree, NoisyMethod::Cuts, NoisyMethod::Filter, NoisyMethod::FilteredCuts, NoisyMethod::Auto].into_iter().map(|method| {
                let mut out = NoisyUnwrapped::default();
                let mut un = NoisyUnwrapper::new(NoisyOptions { method, ..Default::default() }).unwrap();
                let a = Instant::now();
                un.unwrap_into(&f.phase, PhaseNoise::Unknown, None, &mut out).unwrap();
                t.push(a.elapsed().as_secs_f64() * 1e3); sh.push(f.right(&out.unwrapped.wraps)); out }).collect();
            let best = sh[..3].iter().copied().fold(0.0, f64::max);
            let ft = &outs[2].filtered;
            println!("{name:14}{sigma:6}{}| {}| {:?} {:?} {:?} {}", sh.iter().map(|x| format!("{x:9.4}")).collect::<String>(), t.iter().map(|x| format!("{x:7.1}")).collect::<String>(), ft.noise_rad, ft.verdict, outs[4].method, if sh[4] < best - 0.001 { "LOSS" } else { "" });
        }
    }
}
