//! Errors of fused points against what is said of them.

use fusion::nalgebra::{DMatrix, Matrix3, Vector3};
use fusion::point_uncertainty::{CommonError, CommonErrors, PointErrors, Source, shares};
use fusion::{CommonErrorUse, Fused, FusionOptions, Surfel, fuse};

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::common::judge::Judgement;
use crate::common::survey::{Plan, Survey};
use crate::common::wall::Wall;

#[test]
fn fused_points_err_as_they_say() {
    let mut judged = Judgement::default();
    for seed in 100..105 {
        let survey = Survey::new(&Plan::default(), seed);
        let fused = fuse(&survey.registered(), &survey, &survey.common, &FusionOptions::default()).unwrap();
        judged.add(&survey, &fused);
    }
    // Five surveys have some fifty independent errors that many of their points share: a fifth.
    let all = judged.mean("all");
    assert!((0.7..1.3).contains(&all), "{all}");
    for class in ["near", "far", "dark", "grazing", "edge", "sphere", "thin wall"] {
        let found = judged.mean(class);
        // Classes hang on fewer of them.
        assert!((0.35..1.8).contains(&found), "{class}: {found}");
    }
    let corrections = judged.corrections.iter().sum::<f64>() / 5.0;
    assert!((0.5..1.3).contains(&corrections), "{corrections}");
    let thickness = statistics::quantile(&mut judged.thickness, 0.5);
    assert!((0.8..1.2).contains(&thickness), "{thickness}");
    assert!(judged.ghosts * 1000 < judged.surfels, "{} of {}", judged.ghosts, judged.surfels);
}

/// The survey, with so many times the standard deviations of noise and neighbourhoods.
struct Stated<'a>(&'a Survey, f64);

impl PointErrors for Stated<'_> {
    fn noise(&self, point: usize) -> Matrix3<f64> {
        self.0.noise(point) * self.1.powi(2)
    }

    fn sensor(&self, point: usize) -> Option<(u64, Vector3<f64>)> {
        self.0.sensor(point).map(|(neighbourhood, shift)| (neighbourhood, shift * self.1))
    }

    fn common(&self, point: usize, derivatives: &mut Vec<(usize, Vector3<f64>)>) {
        self.0.common(point, derivatives);
    }
}

#[test]
fn where_frames_disagree_beyond_what_is_stated_sigma_says_so() {
    // Poses are known, so that what frames disagree by is what is not stated.
    let plan = Plan { d0_m: 1e-5, lens_mm: 1e-4, pose_m: 1e-5, pose_rad: 1e-5, ..Plan::default() };
    let (mut told, mut disagree, mut seen) = (Vec::new(), 0, 0);
    for seed in 120..122 {
        let survey = Survey::new(&plan, seed);
        let options = FusionOptions { common_errors: CommonErrorUse::AsStated, ..FusionOptions::default() };
        let fused = |errors: &dyn PointErrors| fuse(&survey.registered(), errors, &survey.common, &options).unwrap();
        let is_disputed = |surfel: &&Surfel| surfel.variance_factor > 1.0;
        let honest = fused(&survey);
        disagree += honest.surfels.iter().filter(is_disputed).count();
        seen += honest.surfels.len();
        // Its variance is a quarter of what it should be.
        let [understated, overstated] = [0.5, 2.0].map(|factor| fused(&Stated(&survey, factor)));
        let larger = [&honest, &understated, &overstated].map(|fused| fused.noise_factor);
        assert!(larger[0] == 1.0 && (3.4..4.6).contains(&larger[1]) && larger[2] == 1.0, "{larger:?}");
        let smaller = [&honest, &understated, &overstated].map(Fused::noise_is_overstated);
        assert_eq!(smaller, [false, false, true]);
        for surfel in &understated.surfels {
            let Some((height, _)) = survey.scene.above(&surfel.position, &surfel.normal) else { continue };
            told.push((height / surfel.sigma_m()).powi(2));
        }
    }
    let mean = told.iter().sum::<f64>() / told.len() as f64;
    // 2.2 with what places around say alone: points beyond the gate are missing in the squares.
    assert!((0.8..1.2).contains(&mean), "{mean}");
    assert!(disagree * 100 < seen, "{disagree} of {seen}");
}

#[test]
fn many_frames_of_a_station_are_no_independent_stations() {
    // They average noise; where a surface is none in a cell, all of them see the same.
    let plan = Plan { frames: 8, size: (64, 48), ..Plan::default() };
    let mut judged = Judgement::default();
    for seed in 5..8 {
        let survey = Survey::new(&plan, seed);
        let fused = fuse(&survey.registered(), &survey, &survey.common, &FusionOptions::default()).unwrap();
        assert!(fused.apart.is_empty(), "{:?}", fused.apart);
        judged.add(&survey, &fused);
    }
    let (all, corrections) = (judged.mean("all"), judged.corrections.iter().sum::<f64>() / 3.0);
    assert!((0.6..1.4).contains(&all) && corrections < 1.3, "{all} {corrections}");
}

#[test]
fn what_bends_everywhere_is_not_noise() {
    // Waves with a radius of curvature of 0.25 m, five cells, at their crests; points move along their rays to them.
    let mut wall = Wall::new(4, 160, 0.0005, 0.0, 1e-6, 9);
    let (steepness, wave) = (0.4, 0.1_f64);
    for (point, frame) in wall.points.iter_mut().zip(&wall.frames) {
        let ray = (*point - wall.centres[*frame as usize]).normalize();
        for _ in 0..20 {
            let height = steepness * wave * (point.x / wave).cos();
            *point += ray * ((height - point.z) / ray.z);
        }
    }
    let mut random = Pcg64::new(10, 3);
    for (point, frame) in wall.points.iter_mut().zip(&wall.frames) {
        let ray = (*point - wall.centres[*frame as usize]).normalize();
        let error: f64 = StandardNormal.sample(&mut random);
        *point += ray * (wall.sigma_m * error);
    }
    let fused = fuse(&wall.registered(), &wall, &wall.common, &FusionOptions::default()).unwrap();
    assert!(fused.noise_factor == 1.0, "{}", fused.noise_factor);
}

/// A wall whose frames are all of one station.
struct OneStation<'a>(&'a Wall);

impl PointErrors for OneStation<'_> {
    fn noise(&self, point: usize) -> Matrix3<f64> {
        self.0.noise(point)
    }

    fn sensor(&self, _: usize) -> Option<(u64, Vector3<f64>)> {
        None
    }

    fn common(&self, _: usize, derivatives: &mut Vec<(usize, Vector3<f64>)>) {
        derivatives.push((0, Vector3::z()));
    }
}

#[test]
fn frames_without_noise_do_not_disagree() {
    let wall = Wall::new(10, 40, 3e-9, 0.0, 0.0, 6);
    let options = FusionOptions { common_errors: CommonErrorUse::AsStated, ..FusionOptions::default() };
    let pose = CommonError { name: "S0 dz".to_owned(), source: Source::Pose };
    let common = CommonErrors::new(vec![pose], DMatrix::from_element(1, 1, 0.05 * 0.05)).unwrap();
    let fused = fuse(&wall.registered(), &OneStation(&wall), &common, &options).unwrap();
    assert!(!fused.surfels.is_empty());
    assert!(fused.surfels.iter().all(|surfel| surfel.variance_factor <= 1.0));
}

#[test]
fn noise_averages_out_and_what_is_common_does_not() {
    let options = FusionOptions { common_errors: CommonErrorUse::AsStated, ..FusionOptions::default() };
    let of = |frames: usize| {
        let wall = Wall::new(frames, 60, 0.006, 0.003, 0.002, 5);
        let fused = fuse(&wall.registered(), &wall, &wall.common, &options).unwrap();
        let mean = |source| fused.surfels.iter().map(|s| s.shares.of(source)).sum::<f64>() / fused.surfels.len() as f64;
        (fused.surfels.len() as f64, mean(Source::Noise), mean(Source::Sensor), mean(Source::Pose))
    };
    let (one, many) = (of(1), of(16));
    assert!((one.0 / many.0 - 1.0).abs() < 0.1, "{} {} surfels", one.0, many.0);
    for (one, many) in [(one.1, many.1), (one.2, many.2), (one.3, many.3)] {
        // All of them are independent from frame to frame.
        assert!((one / many / 16.0 - 1.0).abs() < 0.3, "{one} {many}");
    }
    // Nine points a cell share their neighbourhood's error, and a frame its shift.
    assert!((one.2.sqrt() / 0.003 - 1.0).abs() < 0.15, "{}", one.2.sqrt());
    assert!((one.3.sqrt() / 0.002 - 1.0).abs() < 0.05, "{}", one.3.sqrt());
}

#[test]
fn the_mean_is_that_of_generalised_least_squares() {
    use fusion::nalgebra::{DMatrix, DVector, Vector3};
    use fusion::point_uncertainty::{CommonErrors, PointErrors};
    let wall = Wall::new(3, 40, 0.006, 0.004, 0.0, 11);
    let options = FusionOptions { common_errors: CommonErrorUse::AsStated, ..FusionOptions::default() };
    let fused = fuse(&wall.registered(), &wall, &CommonErrors::none(), &options);
    // A derivative by what is not described.
    assert!(fused.is_err());
    let fused = fuse(&wall.registered(), &wall, &wall.common, &options).unwrap();
    let (mut compared, mut tested) = (0, 0);
    for (number, surfel) in fused.surfels.iter().enumerate().filter(|(_, surfel)| surfel.points > 8) {
        let members: Vec<usize> =
            (0..wall.points.len()).filter(|at| fused.surfel_of_point[*at] == Some(number as u32)).collect();
        let n = surfel.normal;
        let size = members.len();
        let shifts: Vec<_> = members.iter().map(|at| wall.sensor(*at).unwrap()).collect();
        let covariance = DMatrix::from_fn(size, size, |i, j| {
            let own = if i == j { n.dot(&(wall.noise(members[i]) * n)) } else { 0.0 };
            let together = if shifts[i].0 == shifts[j].0 { shifts[i].1.dot(&n) * shifts[j].1.dot(&n) } else { 0.0 };
            own + together
        });
        let weights = covariance.try_inverse().unwrap();
        let (mut design, mut heights) = (DMatrix::zeros(size, 3), DVector::zeros(size));
        for (row, at) in members.iter().enumerate() {
            let ray = (wall.points[*at] - wall.centres[wall.frames[*at] as usize]).normalize();
            let height = n.dot(&(wall.points[*at] - surfel.position));
            let foot = wall.points[*at] - ray * (height / n.dot(&ray)) - surfel.position;
            design.set_row(row, &Vector3::new(1.0, foot.x, foot.y).transpose());
            heights[row] = height;
        }
        let normal = design.transpose() * &weights * &design;
        let inverse = normal.try_inverse().unwrap();
        let solution = &inverse * design.transpose() * weights * heights;
        let sigma = surfel.shares.of(Source::Noise) + surfel.shares.of(Source::Sensor);
        // What is taken off for curvature, and the weak prior of the inclination.
        let limit = 0.1 * sigma.sqrt() + 3.0 * surfel.shape_variance.sqrt();
        assert!(solution[0].abs() < limit, "{} {limit}", solution[0]);
        // Places with weak planes that were tested have less: what the test leaves.
        let over = inverse[(0, 0)] / sigma - 1.0;
        assert!((-0.1..0.35).contains(&over), "{} {sigma}", inverse[(0, 0)]);
        tested += usize::from(over > 0.1);
        compared += 1;
    }
    assert!(compared > 200 && tested * 10 < compared, "{tested} of {compared}");
}

#[test]
fn a_fused_cloud_tells_the_errors_of_what_is_computed_from_it() {
    let wall = Wall::new(4, 40, 0.005, 0.002, 0.003, 8);
    let fused = fuse(&wall.registered(), &wall, &wall.common, &FusionOptions::default()).unwrap();
    for (at, surfel) in fused.surfels.iter().enumerate() {
        let found = shares(&vec![(at, surfel.normal)], &fused, &fused.common);
        assert!((found.sigma() / surfel.sigma_m() - 1.0).abs() < 1e-9, "{} {}", found.sigma(), surfel.sigma_m());
    }
    // What two frames differ by is known from the surface, what they have in common is not.
    let last = fused.surfels.last().unwrap();
    let height: f64 = fused.surfels.iter().map(|s| s.position.z).sum::<f64>() / fused.surfels.len() as f64;
    assert!(last.shares.of(Source::Pose).sqrt() > 0.0014 && height.abs() < 0.005);
    let between = shares(&vec![(0, fused.surfels[0].normal), (100, -fused.surfels[100].normal)], &fused, &fused.common);
    assert!(between.of(Source::Pose) < 0.1 * last.shares.of(Source::Pose));
}
