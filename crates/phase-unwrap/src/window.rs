//! Sums over square windows of growing size, and the choice of the largest one that hangs together.

use crate::PrefilterOptions;

/// Weighted phasors and information of each pixel, row by row; zero where masked.
#[derive(Debug, Default)]
pub(crate) struct Planes {
    pub re: Vec<f32>,
    pub im: Vec<f32>,
    pub information: Vec<f32>,
}

impl Planes {
    pub fn resize(&mut self, pixels: usize) {
        for plane in [&mut self.re, &mut self.im, &mut self.information] {
            plane.resize(pixels, 0.0);
        }
    }
}

/// What a pixel has after the search: sum of phasors and information of its window, and the window's half width.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Centre {
    pub re: f32,
    pub im: f32,
    pub information: f32,
    pub radius: f32,
}

/// Column sums and choices of one row, and the choices of the image.
#[derive(Debug, Default)]
pub(crate) struct Windows {
    pub centres: Vec<Centre>,
    /// Sums over the rows of the window, with a rim of `radius` zeros on either side.
    columns: Planes,
    /// Sums over the window.
    sums: Planes,
    /// Choices of the row: sums, information, radius, scatter of the length, and whether the window may still grow.
    best: Planes,
    radius: Vec<f32>,
    scatter: Vec<f32>,
    open: Vec<f32>,
}

/// Limits of the tests, in the form in which they are used.
#[derive(Clone, Copy)]
struct Limits {
    quiet_information: f32,
    target_information: f32,
    coherence: f32,
    deviations: f32,
}

impl Windows {
    /// Searches each pixel's window; without `known` noise, none grows.
    pub fn run(&mut self, planes: &Planes, width: usize, options: &PrefilterOptions, known: bool) {
        let limits = Limits {
            quiet_information: crate::noise::weight(options.quiet_sigma_rad).information,
            target_information: options.target_sigma_rad.powi(-2),
            coherence: options.least_coherence,
            deviations: options.deviations,
        };
        let largest = if known { usize::from(options.largest_radius_px) } else { 0 };
        self.centres.resize(planes.re.len(), Centre::default());
        self.columns.resize(width + 2 * largest);
        self.sums.resize(width);
        self.best.resize(width);
        for plane in [&mut self.radius, &mut self.scatter, &mut self.open] {
            plane.resize(width, 0.0);
        }
        let arch = pulp::Arch::new();
        for row in 0..planes.re.len() / width {
            arch.dispatch(
                #[inline(always)]
                || self.search_row(planes, width, row, largest, limits),
            );
        }
    }

    #[inline(always)]
    fn search_row(&mut self, planes: &Planes, width: usize, row: usize, largest: usize, limits: Limits) {
        let height = planes.re.len() / width;
        self.start_row(planes, width, row, largest, limits);
        for radius in 1..=largest {
            if self.open.iter().all(|open| *open <= 0.0) {
                break;
            }
            for other in [row.wrapping_sub(radius), row + radius] {
                if other < height {
                    self.add_row(planes, width, other, largest);
                }
            }
            self.sum_columns(width, largest, radius);
            self.choose(radius, limits);
        }
        let out = &mut self.centres[row * width..][..width];
        for (col, out) in out.iter_mut().enumerate() {
            let (re, im, information) = (self.best.re[col], self.best.im[col], self.best.information[col]);
            *out = Centre { re, im, information, radius: self.radius[col] };
        }
    }

    #[inline(always)]
    fn start_row(&mut self, planes: &Planes, width: usize, row: usize, rim: usize, limits: Limits) {
        let start = row * width;
        for ((columns, best), source) in self.columns.each().into_iter().zip(self.best.each()).zip(planes.all()) {
            columns[rim..rim + width].copy_from_slice(&source[start..start + width]);
            best.copy_from_slice(&source[start..start + width]);
        }
        self.radius.fill(0.0);
        let rows = self.best.information.iter().zip(&mut self.scatter).zip(&mut self.open);
        for ((&information, scatter), open) in rows {
            // With q = rho^2 the information is 2 q / (1 - q^2); the length scatters (1 - q) / (1 + q) times as the angle.
            let q = information / (1.0 + (1.0 + information * information).sqrt());
            *scatter = (1.0 - q) / (1.0 + q);
            let noisy = information > 0.0 && information < limits.quiet_information;
            *open = if noisy { 1.0 } else { 0.0 };
        }
    }

    #[inline(always)]
    fn add_row(&mut self, planes: &Planes, width: usize, row: usize, rim: usize) {
        for (columns, source) in self.columns.each().into_iter().zip(planes.all()) {
            for (sum, value) in columns[rim..rim + width].iter_mut().zip(&source[row * width..][..width]) {
                *sum += value;
            }
        }
    }

    /// Sums of `2 radius + 1` columns around each pixel.
    #[inline(always)]
    fn sum_columns(&mut self, width: usize, rim: usize, radius: usize) {
        for (sums, columns) in self.sums.each().into_iter().zip(self.columns.all()) {
            let columns = &columns[rim - radius..rim + radius + width];
            sums.copy_from_slice(&columns[..width]);
            for tap in 1..=2 * radius {
                for (sum, value) in sums.iter_mut().zip(&columns[tap..tap + width]) {
                    *sum += value;
                }
            }
        }
    }

    /// Takes the larger window where it hangs together with the smaller one.
    #[inline(always)]
    fn choose(&mut self, radius: usize, limits: Limits) {
        let sums = self.sums.re.iter().zip(&self.sums.im).zip(&self.sums.information);
        let best = self.best.re.iter_mut().zip(&mut self.best.im).zip(&mut self.best.information);
        let state = self.radius.iter_mut().zip(&self.scatter).zip(&mut self.open);
        for ((((&a, &b), &i), ((re, im), information)), ((chosen, &scatter), open)) in sums.zip(best).zip(state) {
            let square = a * a + b * b;
            let shortest = (limits.coherence * i - limits.deviations * (scatter * i).sqrt()).max(0.0);
            let together = square >= shortest * shortest;
            // The smaller window is part of the larger: the variance of the turn is the difference of the variances.
            let variance = 1.0 / information.max(f32::MIN_POSITIVE) - 1.0 / i.max(f32::MIN_POSITIVE);
            let least_cosine = 1.0 - 0.5 * limits.deviations * limits.deviations * variance;
            let length = (square * (*re * *re + *im * *im)).sqrt();
            let same = a * *re + b * *im >= least_cosine * length;
            let accepted = (*open > 0.0) & together & same;
            *re = if accepted { a } else { *re };
            *im = if accepted { b } else { *im };
            *information = if accepted { i } else { *information };
            *chosen = if accepted { radius as f32 } else { *chosen };
            *open = if accepted & (i < limits.target_information) { 1.0 } else { 0.0 };
        }
    }
}

impl Planes {
    fn all(&self) -> [&[f32]; 3] {
        [&self.re, &self.im, &self.information]
    }

    fn each(&mut self) -> [&mut [f32]; 3] {
        [&mut self.re, &mut self.im, &mut self.information]
    }
}
