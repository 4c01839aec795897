//! Models as lists of named parameters, and the way through RON.

use error_models::{AmplitudeHyperbola, Error, FurtherTerms, NamedParameter, PARAMETERS, RangeErrorModel, RangeTerms};

fn model() -> RangeErrorModel {
    RangeErrorModel {
        ambiguity_interval_m: 7.494_811_45,
        terms: RangeTerms { d0: 0.024, periodic: [0.01, -0.02, 0.003, 0.1 / 3.0, -0.005, 0.006], e1: 1e-3, e2: -2e-4 },
        hyperbola: Some(AmplitudeHyperbola { h1: 1e-3, h2: 2e-2, h3: 90.0, amplitude_span: [20.0, 3000.0] }),
        range_span_m: Some([0.5, 7.0]),
        further: FurtherTerms::default(),
    }
}

#[test]
fn a_model_survives_the_way_through_its_parameters() {
    let model = model();
    let mut parameters = model.to_parameters();
    let names: Vec<_> = parameters.iter().map(|p| (p.name.as_str(), p.unit.as_str())).collect();
    assert_eq!(names, PARAMETERS);
    parameters.reverse();
    let span = model.hyperbola.map(|h| h.amplitude_span);
    let back = RangeErrorModel::from_parameters(model.ambiguity_interval_m, &parameters, span, model.range_span_m);
    assert_eq!(back.unwrap(), model);
}

#[test]
fn missing_parameters_are_zero() {
    let parameters = [NamedParameter::estimated("d0", 0.02, 1e-4).unwrap()];
    let model = RangeErrorModel::from_parameters(5.0, &parameters, None, None).unwrap();
    assert_eq!(model.terms, RangeTerms { d0: 0.02, ..RangeTerms::default() });
    assert_eq!(model.hyperbola, None);
    assert_eq!(RangeErrorModel::from_parameters(5.0, &[], None, None).unwrap().terms, RangeTerms::default());
}

#[test]
fn what_is_wrong_with_a_parameter_list_is_said() {
    let read = |parameters: &[NamedParameter]| RangeErrorModel::from_parameters(5.0, parameters, None, None);
    let d0 = NamedParameter::held("d0", 0.1).unwrap();
    assert!(matches!(NamedParameter::held("d1", 0.0), Err(Error::UnknownParameter { name, .. }) if name == "d1"));
    let unknown = NamedParameter { name: "k9".into(), ..d0.clone() };
    assert!(matches!(read(&[unknown]), Err(Error::UnknownParameter { .. })));
    assert!(matches!(read(&[d0.clone(), d0.clone()]), Err(Error::DuplicateParameter { .. })));
    let millimetres = NamedParameter { unit: "mm".into(), ..d0.clone() };
    assert!(matches!(read(&[millimetres]), Err(Error::WrongUnit { expected: "m", .. })));
    let not_a_number = NamedParameter { value: f64::NAN, ..d0.clone() };
    assert!(matches!(read(&[not_a_number]), Err(Error::OutOfDomain { name: "d0", .. })));
    let negative_sigma = NamedParameter { sigma: -1.0, ..d0 };
    assert!(matches!(read(&[negative_sigma]), Err(Error::OutOfDomain { name: "d0", .. })));
    let h1 = NamedParameter::held("h1", 0.1).unwrap();
    assert_eq!(read(std::slice::from_ref(&h1)), Err(Error::MissingAmplitudeSpan));
    // h3 is missing, so it is zero, and Eq. 15 divides by it.
    let spanned = RangeErrorModel::from_parameters(5.0, &[h1], Some([1.0, 2.0]), None);
    assert!(matches!(spanned, Err(Error::OutOfDomain { name: "h3", .. })));
}

#[cfg(feature = "serde")]
mod ron_round_trip {
    use super::*;
    use error_models::{FixedPattern, GrossErrorOptions, ModelSet};
    use proptest::prelude::*;
    use serde::{Serialize, de::DeserializeOwned};

    fn through_ron<T: Serialize + DeserializeOwned>(value: &T) -> T {
        ron::from_str(&ron::to_string(value).unwrap()).unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn terms_keep_every_bit(values in proptest::array::uniform9(proptest::num::f64::NORMAL)) {
            let terms = RangeTerms::from_array(values);
            let bits = |terms: RangeTerms| terms.to_array().map(f64::to_bits);
            prop_assert_eq!(bits(through_ron(&terms)), bits(terms));
        }

        #[test]
        fn patterns_keep_every_bit(offset_m in proptest::collection::vec(proptest::num::f32::NORMAL, 6)) {
            let pattern = FixedPattern { width: 3, height: 2, offset_m, sigma_m: vec![f32::NAN; 6] };
            let bits = |pattern: &FixedPattern| pattern.offset_m.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            prop_assert_eq!(bits(&through_ron(&pattern)), bits(&pattern));
        }
    }

    #[test]
    fn models_sets_and_parameters_come_back_equal() {
        let set = ModelSet { entries: vec![(0.1 / 3.0, vec![model()]), (0.2, vec![model(), model()])] };
        assert_eq!(through_ron(&set), set);
        let parameters = model().to_parameters();
        assert_eq!(through_ron(&parameters), parameters);
        let options = GrossErrorOptions { low_amplitude: Some(0.1), ..GrossErrorOptions::default() };
        assert_eq!(through_ron(&options), options);
        assert_eq!(ron::from_str::<GrossErrorOptions>("()").unwrap(), GrossErrorOptions::default());
        let unknown_sigma = NamedParameter::estimated("d0", 0.1, f64::NAN).unwrap();
        assert!(through_ron(&unknown_sigma).sigma.is_nan());
    }

    #[test]
    fn unknown_fields_are_refused() {
        fn refused<T: DeserializeOwned + Serialize>(value: &T) -> bool {
            let text = ron::to_string(value).unwrap();
            let extended = text.replacen('(', "(surprise:1,", 1);
            assert_ne!(text, extended);
            ron::from_str::<T>(&text).is_ok() && ron::from_str::<T>(&extended).is_err()
        }
        assert!(refused(&model()));
        assert!(refused(&model().terms));
        assert!(refused(&model().hyperbola.unwrap()));
        assert!(refused(&FixedPattern { width: 1, height: 1, offset_m: vec![0.0], sigma_m: Vec::new() }));
        assert!(refused(&ModelSet::default()));
        assert!(refused(&GrossErrorOptions::default()));
        assert!(refused(&NamedParameter::held("d0", 0.0).unwrap()));
    }
}
