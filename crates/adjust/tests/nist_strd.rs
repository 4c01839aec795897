//! NIST's certified nonlinear regressions, from both starts.

#[path = "nist_strd/hard.rs"]
mod hard;

use std::fs;
use std::path::Path;

use adjust::{
    Adjustment, Covariance, Differentiated, EvaluationFailure, ParameterBlock, Parameters, Real, ResidualFunction,
    Scale, SolveOptions,
};

/// One problem: data, starts, certified values and standard deviations.
struct Problem {
    name: String,
    starts: [Vec<f64>; 2],
    certified: Vec<f64>,
    deviations: Vec<f64>,
    sum_of_squares: f64,
    /// Response first.
    data: Vec<Vec<f64>>,
}

fn number(text: &str) -> f64 {
    text.parse().unwrap_or_else(|_| panic!("not a number: {text}"))
}

fn parse(path: &Path) -> Problem {
    let text = fs::read_to_string(path).unwrap();
    let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
    let (mut starts, mut certified, mut deviations) = ([Vec::new(), Vec::new()], Vec::new(), Vec::new());
    let mut sum_of_squares = f64::NAN;
    let mut data = Vec::new();
    let mut in_data = false;
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        if line.starts_with("Data:") {
            in_data = words.get(1) == Some(&"y") || words.get(1).is_some_and(|word| word.starts_with("log"));
        } else if in_data && !words.is_empty() {
            data.push(words.iter().map(|word| number(word)).collect());
        } else if let Some((left, right)) = line.split_once('=')
            && left.trim().strip_prefix('b').is_some_and(|index| index.parse::<usize>().is_ok())
        {
            let values: Vec<f64> = right.split_whitespace().map(number).collect();
            starts[0].push(values[0]);
            starts[1].push(values[1]);
            certified.push(values[2]);
            deviations.push(values[3]);
        } else if line.starts_with("Residual Sum of Squares:") {
            sum_of_squares = number(words[4]);
        }
    }
    if name == "Roszman1" {
        // The file at hand carries an altered b1; NIST certifies this one.
        certified[0] = 0.201_968_663_96;
    }
    Problem { name, starts, certified, deviations, sum_of_squares, data }
}

/// One row of a problem.
struct Row<'p> {
    problem: &'p Problem,
    row: &'p [f64],
}

impl ResidualFunction<1> for Row<'_> {
    fn residual<T: Real>(&self, parameters: &Parameters<'_, T>) -> Result<[T; 1], EvaluationFailure> {
        let b: Vec<T> = parameters.plain(0)?.collect();
        let response = if self.problem.name == "Nelson" { self.row[0].ln() } else { self.row[0] };
        Ok([-model(&self.problem.name, &b, &self.row[1..]) + response])
    }
}

/// Model of the response; for Nelson of its logarithm.
fn model<T: Real>(name: &str, b: &[T], x: &[f64]) -> T {
    use std::f64::consts::PI;
    let t = x[0];
    let decay = |amount: T, rate: T| amount * (-rate * t).exp();
    match name {
        "Chwirut1" | "Chwirut2" => decay(T::from(1.0), b[0]) / (b[1] + b[2] * t),
        "DanWood" => b[0] * (b[1] * t.ln()).exp(),
        "ENSO" => {
            let wave = |period: T, cosine: T, sine: T| {
                let argument = T::from(2.0 * PI * t) / period;
                cosine * argument.cos() + sine * argument.sin()
            };
            b[0] + wave(12.0.into(), b[1], b[2]) + wave(b[3], b[4], b[5]) + wave(b[6], b[7], b[8])
        }
        "Gauss1" | "Gauss2" | "Gauss3" => {
            let bell = |height: T, centre: T, width: T| {
                let z = (-centre + t) / width;
                height * (-(z * z)).exp()
            };
            decay(b[0], b[1]) + bell(b[2], b[3], b[4]) + bell(b[5], b[6], b[7])
        }
        "Hahn1" | "Thurber" => {
            (b[0] + b[1] * t + b[2] * t.powi(2) + b[3] * t.powi(3))
                / (b[4] * t + b[5] * t.powi(2) + b[6] * t.powi(3) + 1.0)
        }
        "Kirby2" => (b[0] + b[1] * t + b[2] * t.powi(2)) / (b[3] * t + b[4] * t.powi(2) + 1.0),
        "Lanczos1" | "Lanczos2" | "Lanczos3" => decay(b[0], b[1]) + decay(b[2], b[3]) + decay(b[4], b[5]),
        "MGH09" => b[0] * (b[1] * t + t * t) / (b[2] * t + b[3] + t * t),
        "MGH10" => b[0] * (b[1] / (b[2] + t)).exp(),
        "MGH17" => b[0] + decay(b[1], b[3]) + decay(b[2], b[4]),
        "Misra1a" | "BoxBOD" => b[0] - decay(b[0], b[1]),
        "Misra1b" => b[0] - b[0] * (b[1] * t / 2.0 + 1.0).powi(-2),
        "Misra1c" => b[0] - b[0] * (b[1] * (2.0 * t) + 1.0).powf(-0.5),
        "Misra1d" => b[0] * b[1] * t / (b[1] * t + 1.0),
        "Nelson" => b[0] - b[1] * t * (-b[2] * x[1]).exp(),
        "Rat42" => b[0] / ((b[1] - b[2] * t).exp() + 1.0),
        // (…)^(1/b4) by way of the logarithm, because the exponent is a parameter.
        "Rat43" => b[0] / (((b[1] - b[2] * t).exp() + 1.0).ln() / b[3]).exp(),
        "Bennett5" => b[0] * (-(b[1] + t).ln() / b[2]).exp(),
        "Eckerle4" => {
            let z = (-b[2] + t) / b[1];
            b[0] / b[1] * (z * z * -0.5).exp()
        }
        "Roszman1" => b[0] - b[1] * t - (b[2] / (-b[3] + t)).atan() / PI,
        other => panic!("no model for {other}"),
    }
}

/// Common decimal digits, at most 11: the certified values carry no more.
fn digits(found: f64, certified: f64) -> f64 {
    let error = ((found - certified) / certified).abs();
    if error == 0.0 { 11.0 } else { (-error.log10()).clamp(0.0, 11.0) }
}

/// Least digits of all parameters, of all standard deviations, and of the sum of squares.
fn solve(problem: &Problem, start: &[f64]) -> Result<(f64, f64, f64, usize), adjust::Error> {
    let mut adjustment = Adjustment::new();
    let block = adjustment.add_block(ParameterBlock::euclidean(start).named("b"));
    let group = adjustment.add_group("response");
    for row in &problem.data {
        let observation = Differentiated::new(&adjustment, [block], Row { problem, row })?;
        adjustment.add_observation(group, observation, &Covariance::from_sigma(1.0))?;
    }
    let solution = adjustment.solve(&SolveOptions::default())?;
    let least = |found: &[f64], certified: &[f64]| {
        found.iter().zip(certified).map(|(f, c)| digits(*f, *c)).fold(f64::INFINITY, f64::min)
    };
    let deviations = solution.standard_deviations(block, Scale::Posterior)?;
    Ok((
        least(solution.values(block)?, &problem.certified),
        least(&deviations, &problem.deviations),
        digits(solution.vtpv(), problem.sum_of_squares),
        solution.iterations(),
    ))
}

/// The files of lower and average difficulty that are looked for; the eight harder problems are part of the test.
const FILES: [&str; 19] = [
    "Chwirut1", "Chwirut2", "DanWood", "ENSO", "Gauss1", "Gauss2", "Gauss3", "Hahn1", "Kirby2", "Lanczos1", "Lanczos2",
    "Lanczos3", "MGH17", "Misra1a", "Misra1b", "Misra1c", "Misra1d", "Nelson", "Roszman1",
];

/// All problems, or the eight harder ones where the captures are not at hand. A single missing file is an error.
fn problems() -> Vec<Problem> {
    let mut problems = hard::problems();
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/real/nist_strd"));
    if folder.is_dir() {
        problems.extend(FILES.map(|name| parse(&folder.join(format!("{name}.dat")))));
    } else {
        println!("skipped: {} is not there", folder.display());
    }
    problems
}

#[test]
fn certified_values_are_reached_from_both_starts() {
    let problems = problems();
    let (mut count, mut parameter_digits, mut deviation_digits, mut unsolved) = (0, 0.0, 0.0, Vec::new());
    for problem in &problems {
        for (index, start) in problem.starts.iter().enumerate() {
            count += 1;
            match solve(problem, start) {
                Ok((parameters, deviations, sum, iterations)) => {
                    println!(
                        "{:9} {index}: {parameters:5.2} {deviations:5.2} {sum:5.2} digits, {iterations} iterations",
                        problem.name
                    );
                    if parameters <= 6.0 {
                        unsolved.push(format!("{} {index}: {parameters:.1} digits", problem.name));
                    }
                    parameter_digits += parameters;
                    deviation_digits += deviations;
                }
                Err(error) => unsolved.push(format!("{} {index}: {error}", problem.name)),
            }
        }
    }
    let (parameters, deviations) = (parameter_digits / f64::from(count), deviation_digits / f64::from(count));
    println!("{count} runs; mean digits: parameters {parameters:.2}, deviations {deviations:.2}");
    assert!(unsolved.is_empty(), "{unsolved:#?}");
    // The end at 1e-8 of a standard deviation leaves at least this much in the mean over the problems. Among the harder
    // ones MGH09 (large residuals, eleven observations) weighs more.
    let all = problems.len() == 27;
    assert!(parameters > if all { 10.4 } else { 10.2 }, "{parameters}");
    assert!(deviations > if all { 10.1 } else { 9.9 }, "{deviations}");
}

#[test]
fn the_last_digit_of_a_start_does_not_decide() {
    // A narrow curved valley, on which damping that falls too fast goes round in circles: 12,000 iterations.
    for problem in hard::problems().iter().filter(|problem| problem.name == "MGH10") {
        for last in 0..8 {
            let start: Vec<f64> = problem.starts[0].iter().map(|b| b * (1.0 + f64::from(last) * 1e-13)).collect();
            let (parameters, ..) = solve(problem, &start).unwrap();
            assert!(parameters > 9.0, "{last}: {parameters} digits");
        }
    }
}
