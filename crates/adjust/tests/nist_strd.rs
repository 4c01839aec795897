//! NIST's certified nonlinear regressions, from both starts.

#[path = "nist_strd/hard.rs"]
mod hard;

use std::fs;
use std::path::Path;

use adjust::{Adjustment, Covariance, FunctionObservation, ParameterBlock, Scale, SolveOptions};

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

/// Numbers that carry their derivatives with respect to up to nine parameters.
#[derive(Clone, Copy)]
struct Dual {
    value: f64,
    d: [f64; 9],
}

impl Dual {
    fn map(self, value: f64, slope: f64) -> Self {
        Self { value, d: self.d.map(|d| slope * d) }
    }
    fn exp(self) -> Self {
        let value = self.value.exp();
        self.map(value, value)
    }
    fn ln(self) -> Self {
        self.map(self.value.ln(), 1.0 / self.value)
    }
    fn cos(self) -> Self {
        self.map(self.value.cos(), -self.value.sin())
    }
    fn sin(self) -> Self {
        self.map(self.value.sin(), self.value.cos())
    }
    fn atan(self) -> Self {
        self.map(self.value.atan(), 1.0 / (1.0 + self.value * self.value))
    }
    /// self^p for a constant p.
    fn powf(self, p: f64) -> Self {
        self.map(self.value.powf(p), p * self.value.powf(p - 1.0))
    }
    /// x^self for a constant x.
    fn exponent_of(self, x: f64) -> Self {
        let value = x.powf(self.value);
        self.map(value, value * x.ln())
    }
    fn combine(self, other: Self, value: f64, own: f64, others: f64) -> Self {
        Self { value, d: std::array::from_fn(|i| own * self.d[i] + others * other.d[i]) }
    }
}

impl From<f64> for Dual {
    fn from(value: f64) -> Self {
        Self { value, d: [0.0; 9] }
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, |$a:ident, $b:ident| $value:expr, $own:expr, $others:expr) => {
        impl std::ops::$trait for Dual {
            type Output = Dual;
            fn $method(self, other: Dual) -> Dual {
                let ($a, $b) = (self.value, other.value);
                self.combine(other, $value, $own, $others)
            }
        }
        impl std::ops::$trait<f64> for Dual {
            type Output = Dual;
            fn $method(self, other: f64) -> Dual {
                std::ops::$trait::$method(self, Dual::from(other))
            }
        }
        impl std::ops::$trait<Dual> for f64 {
            type Output = Dual;
            fn $method(self, other: Dual) -> Dual {
                std::ops::$trait::$method(Dual::from(self), other)
            }
        }
    };
}
operator!(Add, add, |a, b| a + b, 1.0, 1.0);
operator!(Sub, sub, |a, b| a - b, 1.0, -1.0);
operator!(Mul, mul, |a, b| a * b, b, a);
operator!(Div, div, |a, b| a / b, 1.0 / b, -a / (b * b));

impl std::ops::Neg for Dual {
    type Output = Dual;
    fn neg(self) -> Dual {
        self.map(-self.value, -1.0)
    }
}

/// Model of the response; for Nelson of its logarithm.
fn model(name: &str, b: &[Dual], x: &[f64]) -> Dual {
    use std::f64::consts::PI;
    let t = x[0];
    match name {
        "Chwirut1" | "Chwirut2" => (-b[0] * t).exp() / (b[1] + b[2] * t),
        "DanWood" => b[0] * b[1].exponent_of(t),
        "ENSO" => {
            let wave = |period: Dual, cosine: Dual, sine: Dual| {
                let argument = 2.0 * PI * t / period;
                cosine * argument.cos() + sine * argument.sin()
            };
            b[0] + wave(12.0.into(), b[1], b[2]) + wave(b[3], b[4], b[5]) + wave(b[6], b[7], b[8])
        }
        "Gauss1" | "Gauss2" | "Gauss3" => {
            let bell = |height: Dual, centre: Dual, width: Dual| {
                let z = (t - centre) / width;
                height * (-(z * z)).exp()
            };
            b[0] * (-b[1] * t).exp() + bell(b[2], b[3], b[4]) + bell(b[5], b[6], b[7])
        }
        "Hahn1" | "Thurber" => {
            (b[0] + b[1] * t + b[2] * t.powi(2) + b[3] * t.powi(3))
                / (1.0 + b[4] * t + b[5] * t.powi(2) + b[6] * t.powi(3))
        }
        "Kirby2" => (b[0] + b[1] * t + b[2] * t.powi(2)) / (1.0 + b[3] * t + b[4] * t.powi(2)),
        "Lanczos1" | "Lanczos2" | "Lanczos3" => {
            b[0] * (-b[1] * t).exp() + b[2] * (-b[3] * t).exp() + b[4] * (-b[5] * t).exp()
        }
        "MGH09" => b[0] * (t * t + t * b[1]) / (t * t + t * b[2] + b[3]),
        "MGH10" => b[0] * (b[1] / (t + b[2])).exp(),
        "MGH17" => b[0] + b[1] * (-b[3] * t).exp() + b[2] * (-b[4] * t).exp(),
        "Misra1a" | "BoxBOD" => b[0] * (1.0 - (-b[1] * t).exp()),
        "Misra1b" => b[0] * (1.0 - (1.0 + b[1] * t / 2.0).powf(-2.0)),
        "Misra1c" => b[0] * (1.0 - (1.0 + 2.0 * b[1] * t).powf(-0.5)),
        "Misra1d" => b[0] * b[1] * t / (1.0 + b[1] * t),
        "Nelson" => b[0] - b[1] * t * (-b[2] * x[1]).exp(),
        "Rat42" => b[0] / (1.0 + (b[1] - b[2] * t).exp()),
        // (…)^(1/b4) by way of the logarithm, because the exponent is a parameter.
        "Rat43" => b[0] / ((1.0 + (b[1] - b[2] * t).exp()).ln() / b[3]).exp(),
        "Bennett5" => b[0] * ((b[1] + t).ln() * (-1.0 / b[2])).exp(),
        "Eckerle4" => {
            let z = (t - b[2]) / b[1];
            b[0] / b[1] * (-0.5 * (z * z)).exp()
        }
        "Roszman1" => b[0] - b[1] * t - (b[2] / (t - b[3])).atan() / PI,
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
        let observation = FunctionObservation::new([block], 1, move |parameters, residual, jacobians| {
            let b: Vec<Dual> = parameters[0]
                .iter()
                .enumerate()
                .map(|(i, &value)| Dual { value, d: std::array::from_fn(|j| f64::from(u8::from(i == j))) })
                .collect();
            let response = if problem.name == "Nelson" { row[0].ln() } else { row[0] };
            let predicted = model(&problem.name, &b, &row[1..]);
            residual[0] = response - predicted.value;
            if let Some(jacobians) = jacobians {
                jacobians.row(0, 0).copy_from_slice(&predicted.d[..b.len()]);
            }
            Ok(())
        });
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
