//! Distributions against values computed with 40 digits, against printed tables, and against themselves.
use approx::assert_relative_eq;
use proptest::prelude::*;
use statistics::{Distribution, chi_squared_limit};

/// Distribution, value, probability of exceeding it (incomplete gamma and beta functions to 40 digits).
const SURVIVAL: [(Distribution, f64, f64); 58] = [
    (Distribution::Normal, 0.0, 0.5),
    (Distribution::Normal, 0.001, 0.49960105778608894),
    (Distribution::Normal, 0.5, 0.3085375387259869),
    (Distribution::Normal, 1.0, 0.15865525393145705),
    (Distribution::Normal, 1.959963984540054, 0.025000000000000011),
    (Distribution::Normal, 3.2905267314919255, 4.9999999999994536e-4),
    (Distribution::Normal, 8.0, 6.2209605742717841e-16),
    (Distribution::Normal, 20.0, 2.7536241186062337e-89),
    (Distribution::ChiSquared { dof: 0.5 }, 1e-6, 0.97066261677487692),
    (Distribution::ChiSquared { dof: 0.5 }, 0.3, 0.33317180231535664),
    (Distribution::ChiSquared { dof: 0.5 }, 9.0, 8.6818413972194711e-4),
    (Distribution::ChiSquared { dof: 1.0 }, 0.0001, 0.99202128737073679),
    (Distribution::ChiSquared { dof: 1.0 }, 3.8414588206941254, 0.050000000000000018),
    (Distribution::ChiSquared { dof: 1.0 }, 30.0, 4.3204630578274973e-8),
    (Distribution::ChiSquared { dof: 2.0 }, 0.1, 0.95122942450071401),
    (Distribution::ChiSquared { dof: 2.0 }, 5.0, 0.082084998623898795),
    (Distribution::ChiSquared { dof: 7.0 }, 0.5, 0.99944648139042497),
    (Distribution::ChiSquared { dof: 7.0 }, 7.0, 0.42887985755305472),
    (Distribution::ChiSquared { dof: 7.0 }, 40.0, 1.2587903873713088e-6),
    (Distribution::ChiSquared { dof: 30.0 }, 8.0, 0.99998006827251729),
    (Distribution::ChiSquared { dof: 30.0 }, 29.3, 0.50188096921772733),
    (Distribution::ChiSquared { dof: 30.0 }, 70.0, 4.8549188786169299e-5),
    (Distribution::ChiSquared { dof: 2500.0 }, 2200.0, 0.99999496792468971),
    (Distribution::ChiSquared { dof: 2500.0 }, 2500.0, 0.49623871942280827),
    (Distribution::ChiSquared { dof: 2500.0 }, 2900.0, 3.5262644498142581e-8),
    (Distribution::ChiSquared { dof: 200000.0 }, 198000.0, 0.99924258007882523),
    (Distribution::ChiSquared { dof: 200000.0 }, 200000.0, 0.49957947788963482),
    (Distribution::ChiSquared { dof: 200000.0 }, 203000.0, 1.1736845137221691e-6),
    (Distribution::StudentT { dof: 1.0 }, 0.1, 0.46827448256944643),
    (Distribution::StudentT { dof: 1.0 }, 1.0, 0.25),
    (Distribution::StudentT { dof: 1.0 }, 12.706204736174707, 0.024999999999999996),
    (Distribution::StudentT { dof: 1.0 }, 1000000.0, 3.1830988618368457e-7),
    (Distribution::StudentT { dof: 2.5 }, 0.3, 0.39367118574759861),
    (Distribution::StudentT { dof: 2.5 }, 4.0, 0.019506487920659123),
    (Distribution::StudentT { dof: 10.0 }, 2.228138851964939, 0.025000000000904316),
    (Distribution::StudentT { dof: 10.0 }, 6.0, 6.6054430177392802e-5),
    (Distribution::StudentT { dof: 200.0 }, 0.01, 0.49601562757664056),
    (Distribution::StudentT { dof: 200.0 }, 1.9, 0.029435886164107088),
    (Distribution::StudentT { dof: 200.0 }, 7.0, 1.8947143250444694e-11),
    (Distribution::StudentT { dof: 30000.0 }, 0.5, 0.30853937239010866),
    (Distribution::StudentT { dof: 30000.0 }, 3.3, 4.8398757588188495e-4),
    (Distribution::Fisher { numerator: 1.0, denominator: 1.0 }, 0.2, 0.73227952719876998),
    (Distribution::Fisher { numerator: 1.0, denominator: 1.0 }, 161.4, 0.050007348139564308),
    (Distribution::Fisher { numerator: 5.0, denominator: 10.0 }, 0.05, 0.99796798193141539),
    (Distribution::Fisher { numerator: 5.0, denominator: 10.0 }, 3.325834530413013, 0.049999999999999959),
    (Distribution::Fisher { numerator: 5.0, denominator: 10.0 }, 30.0, 1.0324872909799376e-5),
    (Distribution::Fisher { numerator: 3.0, denominator: 2400.0 }, 0.9, 0.44038970931227918),
    (Distribution::Fisher { numerator: 3.0, denominator: 2400.0 }, 5.42, 1.0276325949792995e-3),
    (Distribution::Fisher { numerator: 3.0, denominator: 2400.0 }, 12.0, 8.4982842660532019e-8),
    (Distribution::Fisher { numerator: 120.0, denominator: 60.0 }, 0.6, 0.99078988494430117),
    (Distribution::Fisher { numerator: 120.0, denominator: 60.0 }, 1.0, 0.50992833564525184),
    (Distribution::Fisher { numerator: 120.0, denominator: 60.0 }, 1.9, 3.2632867928613366e-3),
    (Distribution::Tau { dof: 2.0 }, 0.3, 0.431959309801612),
    (Distribution::Tau { dof: 2.0 }, 1.3, 0.12880525314484912),
    (Distribution::Tau { dof: 10.0 }, 1.0, 0.17171819806895676),
    (Distribution::Tau { dof: 10.0 }, 2.5, 1.8857787793529928e-3),
    (Distribution::Tau { dof: 500.0 }, 0.1, 0.4602315425909925),
    (Distribution::Tau { dof: 500.0 }, 3.0, 1.3100606508949224e-3),
];

#[test]
fn tails_agree_with_forty_digits() {
    for (distribution, x, expected) in SURVIVAL {
        // Series and fractions add a few hundred terms; the exponent carries rounding of the size of its terms.
        assert_relative_eq!(distribution.survival(x), expected, max_relative = 2e-12);
        assert_relative_eq!(distribution.cumulative(x), 1.0 - expected, epsilon = 1e-14, max_relative = 2e-12);
        // Where the density vanishes a quantile is not defined by its probability.
        if expected < 1.0 - 1e-6 {
            let back = distribution.upper_quantile(distribution.survival(x));
            assert_relative_eq!(back, x, epsilon = 1e-13, max_relative = 1e-10);
        }
    }
}

#[test]
fn critical_values_agree_with_tables() {
    // Textbook tables: two-sided for t and normal, upper for the others; τ from [Pope1976] by t.
    for (distribution, level, expected, digits) in [
        (Distribution::Normal, 0.05, 1.9600, 5e-5),
        (Distribution::Normal, 0.001, 3.2905, 5e-5),
        (Distribution::StudentT { dof: 1.0 }, 0.05, 12.706, 5e-4),
        (Distribution::StudentT { dof: 10.0 }, 0.01, 3.169, 5e-4),
        (Distribution::StudentT { dof: 120.0 }, 0.05, 1.980, 5e-4),
        (Distribution::ChiSquared { dof: 1.0 }, 0.05, 3.841, 5e-4),
        (Distribution::ChiSquared { dof: 10.0 }, 0.01, 23.209, 5e-4),
        (Distribution::ChiSquared { dof: 100.0 }, 0.05, 124.342, 5e-4),
        (Distribution::Fisher { numerator: 5.0, denominator: 10.0 }, 0.05, 3.33, 5e-3),
        (Distribution::Fisher { numerator: 3.0, denominator: 120.0 }, 0.01, 3.95, 5e-3),
    ] {
        assert_relative_eq!(distribution.critical(level), expected, epsilon = digits);
        assert_relative_eq!(distribution.p_value(distribution.critical(level)), level, max_relative = 1e-11);
    }
    let (dof, level) = (25.0, 0.01);
    let t = Distribution::StudentT { dof: dof - 1.0 }.critical(level);
    let expected = (dof).sqrt() * t / (dof - 1.0 + t * t).sqrt();
    assert_relative_eq!(Distribution::Tau { dof }.critical(level), expected, max_relative = 1e-12);
}

#[test]
fn what_lies_outside_the_domain_is_nan() {
    for distribution in [
        Distribution::ChiSquared { dof: 0.0 },
        Distribution::StudentT { dof: f64::NAN },
        Distribution::Fisher { numerator: 1.0, denominator: f64::INFINITY },
        Distribution::Tau { dof: 1.0 },
    ] {
        assert!(distribution.survival(1.0).is_nan() && distribution.critical(0.05).is_nan(), "{distribution:?}");
    }
    for level in [-0.1, 1.1, f64::NAN] {
        assert!(Distribution::Normal.upper_quantile(level).is_nan());
    }
    assert!(Distribution::Normal.cumulative(f64::NAN).is_nan());
    assert_eq!(Distribution::Normal.survival(f64::INFINITY), 0.0);
    assert_eq!(Distribution::Normal.upper_quantile(0.0), f64::INFINITY);
    assert_eq!(Distribution::ChiSquared { dof: 3.0 }.quantile(0.0), 0.0);
    assert_relative_eq!(Distribution::Tau { dof: 9.0 }.upper_quantile(0.0), 3.0, epsilon = 1e-12);
    assert_eq!(Distribution::ChiSquared { dof: 3.0 }.survival(-1.0), 1.0);
}

#[test]
fn limits_grow_with_the_freedom_and_are_infinite_without() {
    let [four, between, five] = [4.0, 4.3, 5.0].map(|dof| chi_squared_limit(dof, 1e-3));
    assert!(four < between && between < five);
    assert_eq!(chi_squared_limit(0.0, 1e-3), f64::INFINITY);
    // R: qchisq(p, df, lower.tail = FALSE); df = 2 is -2 ln p.
    for (dof, level, expected) in [
        (1.0, 1e-3, 10.827_566_170_662_733),
        (2.0, 1e-4, 18.420_680_743_952_367),
        (5.0, 0.01, 15.086_272_469_388_99),
        (9.0, 0.001, 27.877_164_871_256_57),
        (100.0, 0.05, 124.342_113_404_004_1),
    ] {
        assert_relative_eq!(chi_squared_limit(dof, level), expected, max_relative = 1e-12);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn quantiles_undo_probabilities(p in 1e-6..0.999_999_f64, dof in 1.1..3000.0_f64, other in 0.5..500.0_f64) {
        for distribution in [
            Distribution::Normal,
            Distribution::ChiSquared { dof },
            Distribution::StudentT { dof },
            Distribution::Fisher { numerator: other, denominator: dof },
            Distribution::Tau { dof },
        ] {
            // A step of the last digit of x moves the probability by x times the density, at most some hundred here.
            prop_assert!((distribution.cumulative(distribution.quantile(p)) - p).abs() < 1e-12);
            prop_assert!((distribution.survival(distribution.upper_quantile(p)) - p).abs() < 1e-12);
        }
    }
}
