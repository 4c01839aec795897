//! Arrays in `.npy` and `.npz`: round trips, numpy's own bytes, and every way a file can be cut or lie.
#![cfg(feature = "npz")]

use crate::common;
use std::io::{Cursor, Write};

use proptest::prelude::*;
use range_io::Error;
use range_io::npz::{Array, Element, NpzReader, NpzWriter, Values, read_npy};

fn written<T: Element>(shape: &[usize], values: &[T]) -> Vec<u8> {
    let mut writer = NpzWriter::new("memory.npz", Cursor::new(Vec::new()));
    writer.add("a", shape, values).unwrap();
    writer.finish().unwrap().into_inner()
}

fn read(bytes: &[u8]) -> Result<Array, range_io::Error> {
    NpzReader::new("memory.npz", Cursor::new(bytes))?.read("a", |_| Ok(()))
}

/// The bytes of an `.npy` with a given header dictionary.
fn npy(header: &str, data: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

fn archive(method: zip::CompressionMethod, npy: &[u8]) -> Vec<u8> {
    let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default().compression_method(method);
    writer.start_file("a.npy", options).unwrap();
    writer.write_all(npy).unwrap();
    writer.finish().unwrap().into_inner()
}

fn refusal(header: &str, data: &[u8]) -> String {
    read(&archive(zip::CompressionMethod::Stored, &npy(header, data))).unwrap_err().to_string()
}

proptest! {
    #![proptest_config(common::cases(32))]

    #[test]
    fn every_type_comes_back_bit_for_bit(words in prop::collection::vec(any::<u64>(), 1..200)) {
        let shape = [words.len()];
        let floats: Vec<f32> = words.iter().map(|&w| f32::from_bits(w as u32)).collect();
        let Values::F32(back) = read(&written(&shape, &floats)).unwrap().values else { panic!("type") };
        prop_assert!(back.iter().zip(&floats).all(|(a, b)| a.to_bits() == b.to_bits()));
        let doubles: Vec<f64> = words.iter().map(|&w| f64::from_bits(w)).collect();
        let Values::F64(back) = read(&written(&shape, &doubles)).unwrap().values else { panic!("type") };
        prop_assert!(back.iter().zip(&doubles).all(|(a, b)| a.to_bits() == b.to_bits()));
        let bytes: Vec<u8> = words.iter().map(|&w| w as u8).collect();
        prop_assert_eq!(read(&written(&shape, &bytes)).unwrap().values, Values::U8(bytes));
        let counts: Vec<u16> = words.iter().map(|&w| w as u16).collect();
        prop_assert_eq!(read(&written(&shape, &counts)).unwrap().values, Values::U16(counts));
        let differences: Vec<i16> = words.iter().map(|&w| w as i16).collect();
        prop_assert_eq!(read(&written(&shape, &differences)).unwrap().values, Values::I16(differences));
        let integers: Vec<i32> = words.iter().map(|&w| w as i32).collect();
        prop_assert_eq!(read(&written(&shape, &integers)).unwrap().values, Values::I32(integers));
        let long: Vec<i64> = words.iter().map(|&w| w as i64).collect();
        prop_assert_eq!(read(&written(&shape, &long)).unwrap().values, Values::I64(long));
        let truths: Vec<bool> = words.iter().map(|&w| w & 1 == 1).collect();
        prop_assert_eq!(read(&written(&shape, &truths)).unwrap().values, Values::Bool(truths));
    }

    #[test]
    fn damaged_bytes_never_pass_for_the_array(at in 0_usize..400, flip in 1_u8..=255) {
        let values: Vec<f32> = (0..40).map(|i| i as f32 * 0.37).collect();
        let mut bytes = written(&[5, 8], &values);
        let at = at % bytes.len();
        bytes[at] ^= flip;
        // What the archive does not protect (dates, attributes) may change; the array may not.
        if let Ok(array) = read(&bytes) {
            prop_assert_eq!(array, Array { shape: vec![5, 8], values: Values::F32(values) });
        }
    }
}

#[test]
fn a_file_cut_anywhere_is_an_error() {
    let values: Vec<f32> = (0..30).map(|i| i as f32).collect();
    let bytes = written(&[5, 6], &values);
    assert!(read(&bytes).is_ok());
    for length in 0..bytes.len() {
        let error = read(&bytes[..length]).expect_err("a part of a file was taken for the whole");
        assert!(error.to_string().starts_with("memory.npz: "), "{error}");
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.npy");
    let whole = npy("{'descr': '<u2', 'fortran_order': False, 'shape': (3,), }", &[1, 0, 2, 0, 3, 0]);
    for length in 0..=whole.len() {
        std::fs::write(&file, &whole[..length]).unwrap();
        assert_eq!(read_npy(&file, "a", |_| Ok(())).is_ok(), length == whole.len());
    }
}

#[test]
fn numpy_headers_of_all_versions_are_read() {
    let dictionary = "{'descr': '<i2', 'fortran_order': False, 'shape': (2, 1), }\n";
    for version in 1..=3_u8 {
        let mut bytes = b"\x93NUMPY".to_vec();
        bytes.extend([version, 0]);
        match version {
            1 => bytes.extend((dictionary.len() as u16).to_le_bytes()),
            _ => bytes.extend((dictionary.len() as u32).to_le_bytes()),
        }
        bytes.extend(dictionary.as_bytes());
        bytes.extend([0xFF, 0xFF, 0x00, 0x01]);
        for method in [zip::CompressionMethod::Stored, zip::CompressionMethod::Deflated] {
            let array = read(&archive(method, &bytes)).unwrap();
            assert_eq!(array, Array { shape: vec![2, 1], values: Values::I16(vec![-1, 256]) });
        }
    }
    let scalar = npy("{'descr': '|b1', 'fortran_order': False, 'shape': ()}", &[1]);
    let array = read(&archive(zip::CompressionMethod::Stored, &scalar)).unwrap();
    assert_eq!(array, Array { shape: vec![], values: Values::Bool(vec![true]) });
}

#[test]
fn headers_are_written_as_numpy_writes_them() {
    let bytes = written(&[3], &[1.0_f32, 2.0, 3.0]);
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
    let mut member = Vec::new();
    std::io::copy(&mut archive.by_name("a.npy").unwrap(), &mut member).unwrap();
    let header = b"\x93NUMPY\x01\x00\x76\x00{'descr': '<f4', 'fortran_order': False, 'shape': (3,), }";
    assert_eq!(&member[..header.len()], header);
    assert_eq!(member.len(), 128 + 12);
}

#[test]
fn what_is_not_read_is_refused_by_name() {
    let said = |header: &str, word: &str| {
        let message = refusal(header, &[0; 8]);
        assert!(message.starts_with("memory.npz: array `a` ") && message.contains(word), "{message}");
    };
    said("{'descr': '<f4', 'fortran_order': True, 'shape': (1, 2), }", "Fortran order");
    said("{'descr': '>f4', 'fortran_order': False, 'shape': (2,), }", "`>f4`");
    said("{'descr': '<c8', 'fortran_order': False, 'shape': (1,), }", "`<c8`");
    said("{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (2,), }", "structured");
    said("{'descr': '<f4', 'fortran_order': False, 'shape': (3,), }", "at most");
    said("{'descr': '<f4', 'fortran_order': False, 'shape': (1,), }", "more bytes");
    said("{'descr': '<f4', 'fortran_order': False, 'shape': (-1,), }", "axis");
    said("{'descr': '<f4', 'shape': (2,), }", "fortran_order");
    said("{'descr': '<f4', 'fortran_order': False, }", "shape");
    said("{'descr': '<f4' 'fortran_order': False}", "not understood");
    said("", "not understood");
}

#[test]
fn absurd_shapes_are_refused_before_anything_is_allocated() {
    for shape in ["(4000000000000000000, 4)", "(99999999999999999999999,)", "(1000000000000,)"] {
        let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
        let message = refusal(&header, &[0; 16]);
        assert!(message.contains("promises") || message.contains("axis"), "{message}");
    }
    // A compressed member is held to what deflate can make of its bytes.
    let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (100000000,), }";
    let bytes = archive(zip::CompressionMethod::Deflated, &npy(header, &[0; 4096]));
    assert!(read(&bytes).unwrap_err().to_string().contains("promises"));
}

#[test]
fn missing_arrays_are_named_with_those_there_are() {
    let bytes = written(&[1], &[1_u8]);
    let mut reader = NpzReader::new("memory.npz", Cursor::new(bytes.as_slice())).unwrap();
    assert_eq!(reader.names(), ["a"]);
    let error = reader.read("range", |_| Ok(())).unwrap_err();
    assert!(matches!(&error, Error::MissingArray { array, .. } if array == "range"));
    assert_eq!(error.to_string(), "memory.npz: there is no array `range`, only `a`");
}

#[test]
fn a_shape_that_does_not_fit_the_values_is_refused() {
    let mut writer = NpzWriter::new("memory.npz", Cursor::new(Vec::new()));
    assert!(matches!(writer.add("a", &[2, 2], &[1_u8]), Err(Error::Array { .. })));
}
