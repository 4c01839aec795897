//! Observation equations of the network, Eqs. 4-15. Corrections are functions of what is observed; they are taken at the
//! modelled image point and range, the fixed point of the equations. At the measured ones they would carry the noise,
//! which a steep correction makes smaller: least squares takes that for a better fit.

use std::sync::Arc;

use adjust::{BlockId, EvaluationFailure, Jacobians, Observation, Parameters, Real, ResidualFunction, RigidPose};
use camera_model::Camera;
use error_models::RangeErrorModel;
use nalgebra::{Isometry3, Matrix3, Point3, RowVector2, RowVector3, SMatrix, Vector3};

use crate::functional_model::hyperbola_steps::by_steps;
use crate::functional_model::image_model::{ImageModel, image_model};
use crate::functional_model::terms::{CAMERA_VALUES, Seen, modelled_range};

/// A target in the frame of a camera, with the derivatives of its coordinates.
struct InCamera {
    point: Vector3<f64>,
    by_pose: SMatrix<f64, 3, 6>,
    by_point: Matrix3<f64>,
    /// By `rig_from_camera`; zero where the pose is that of the camera itself.
    by_mounting: SMatrix<f64, 3, 6>,
}

impl InCamera {
    fn new(pose: &[f64], point: &[f64]) -> Result<Self, EvaluationFailure> {
        let world_from_camera = RigidPose::isometry(pose)?;
        let &[x, y, z] = point else { return Err(EvaluationFailure::new("a target has three coordinates")) };
        let point = world_from_camera.inverse_transform_point(&Point3::new(x, y, z)).coords;
        let by_point = *world_from_camera.rotation.inverse().to_rotation_matrix().matrix();
        let mut by_pose = SMatrix::<f64, 3, 6>::zeros();
        by_pose.fixed_view_mut::<3, 3>(0, 0).copy_from(&-by_point);
        by_pose.fixed_view_mut::<3, 3>(0, 3).copy_from(&point.cross_matrix());
        Ok(Self { point, by_pose, by_point, by_mounting: SMatrix::zeros() })
    }

    /// The same target in the frame of a camera that sits on the one of this frame.
    fn mounted(&self, rig_from_camera: &[f64]) -> Result<Self, EvaluationFailure> {
        let in_rig: [f64; 3] = self.point.into();
        let own = Self::new(rig_from_camera, &in_rig)?;
        Ok(Self {
            point: own.point,
            by_pose: own.by_point * self.by_pose,
            by_point: own.by_point * self.by_point,
            by_mounting: own.by_pose,
        })
    }
}

/// An image point, a range, or both, of one target from one station.
/// Blocks: pose, target, camera, the range set where there is a range, and `rig_from_camera` where the pose is that of a rig.
#[derive(Debug, Clone)]
pub(crate) struct SightingEquation {
    pub(crate) blocks: Vec<BlockId>,
    pub(crate) camera: Camera,
    /// Observed image point, pixel.
    pub(crate) pixel: [f64; 2],
    pub(crate) uses_pixel: bool,
    pub(crate) range: Option<RangeEquation>,
    /// Whether the pose is that of a rig, on which the camera sits: the last block is its mounting.
    pub(crate) is_mounted: bool,
}

/// The range of a sighting.
#[derive(Debug, Clone)]
pub(crate) struct RangeEquation {
    pub(crate) range_m: f64,
    pub(crate) amplitude: f64,
    pub(crate) drift_m: f64,
    pub(crate) model: Arc<RangeErrorModel>,
    pub(crate) widths: Arc<[usize]>,
    /// Whether the hyperbola is stepped in level, height and slope.
    pub(crate) natural_steps: bool,
}

impl SightingEquation {
    fn image(
        &self,
        target: &InCamera,
        model: &ImageModel,
        residual: &mut [f64],
        jacobians: Option<&mut Jacobians<'_>>,
    ) {
        residual[0] = self.pixel[0] - model.pixel[0];
        residual[1] = self.pixel[1] - model.pixel[1];
        if let Some(jacobians) = jacobians {
            let (by_pose, by_point) = (model.by_camera_point * target.by_pose, model.by_camera_point * target.by_point);
            let by_mounting = self.is_mounted.then(|| model.by_camera_point * target.by_mounting);
            for axis in 0..2 {
                if let Some(by_mounting) = &by_mounting {
                    copy(jacobians.row(self.blocks.len() - 1, axis), by_mounting.row(axis).iter());
                }
                copy(jacobians.row(0, axis), by_pose.row(axis).iter());
                copy(jacobians.row(1, axis), by_point.row(axis).iter());
                copy(jacobians.row(2, axis), model.by_camera[axis].iter());
            }
        }
    }

    #[allow(clippy::too_many_arguments)] // What an evaluation has at hand.
    fn range(
        &self,
        range: &RangeEquation,
        parameters: &[&[f64]],
        target: &InCamera,
        image: &ImageModel,
        row: usize,
        residual: &mut [f64],
        jacobians: Option<&mut Jacobians<'_>>,
    ) -> Result<(), EvaluationFailure> {
        let format = &self.camera.format;
        let [x, y] = format.image_from_pixel(image.pixel);
        let seen = Seen {
            range_m: range.range_m,
            x_mm: x - parameters[2][0],
            y_mm: y - parameters[2][1],
            amplitude: range.amplitude,
            drift_m: range.drift_m,
        };
        let distance = target.point.norm();
        let mut by_terms = vec![0.0; parameters[3].len()];
        let modelled = modelled_range(&range.model, &range.widths, &seen, parameters[3], distance, &mut by_terms);
        let modelled = modelled.map_err(EvaluationFailure::new)?;
        residual[row] = range.range_m - modelled.range_m;
        if let Some(jacobians) = jacobians {
            if range.natural_steps {
                by_steps(parameters[3], &mut by_terms);
            }
            // By column and row of the modelled image point.
            let [pitch_x, pitch_y] = format.pixel_pitch_mm;
            let by_pixel = RowVector2::new(modelled.by_x * pitch_x, -modelled.by_y * pitch_y);
            let direction: RowVector3<f64> = (target.point * (modelled.by_distance / distance)).transpose();
            let by_camera_point = direction + by_pixel * image.by_camera_point;
            copy(jacobians.row(0, row), (by_camera_point * target.by_pose).iter());
            copy(jacobians.row(1, row), (by_camera_point * target.by_point).iter());
            if self.is_mounted {
                copy(jacobians.row(self.blocks.len() - 1, row), (by_camera_point * target.by_mounting).iter());
            }
            let own = [-modelled.by_x, -modelled.by_y].into_iter().chain(std::iter::repeat(0.0));
            let by_camera = image.by_camera[0].iter().zip(&image.by_camera[1]).zip(own);
            let by_camera = by_camera.map(|((col, row), own)| by_pixel[0] * col + by_pixel[1] * row + own);
            jacobians.row(2, row).iter_mut().zip(by_camera).for_each(|(out, value)| *out = value);
            copy(jacobians.row(3, row), by_terms.iter());
        }
        Ok(())
    }
}

fn copy<'d>(out: &mut [f64], values: impl Iterator<Item = &'d f64>) {
    out.iter_mut().zip(values).for_each(|(out, value)| *out = *value);
}

impl Observation for SightingEquation {
    fn dimension(&self) -> usize {
        2 * usize::from(self.uses_pixel) + usize::from(self.range.is_some())
    }

    fn blocks(&self) -> &[BlockId] {
        &self.blocks
    }

    fn evaluate(
        &self,
        parameters: &[&[f64]],
        residual: &mut [f64],
        mut jacobians: Option<&mut Jacobians<'_>>,
    ) -> Result<(), EvaluationFailure> {
        let mut target = InCamera::new(parameters[0], parameters[1])?;
        if let Some(mounting) = parameters.last().filter(|_| self.is_mounted) {
            target = target.mounted(mounting)?;
        }
        let image = image_model(&self.camera, parameters[2], &target.point, jacobians.is_some())?;
        if self.uses_pixel {
            self.image(&target, &image, residual, jacobians.as_deref_mut());
        }
        if let Some(range) = &self.range {
            self.range(range, parameters, &target, &image, 2 * usize::from(self.uses_pixel), residual, jacobians)?;
        }
        Ok(())
    }
}

/// An image point of the passive camera. Blocks: pose of the range camera, target, `range_camera_from_passive`, passive
/// camera.
#[derive(Debug, Clone)]
pub(crate) struct PassivePoint {
    pub(crate) camera: Camera,
    pub(crate) pixel: [f64; 2],
}

impl ResidualFunction<2> for PassivePoint {
    fn residual<T: Real>(&self, parameters: &Parameters<'_, T>) -> Result<[T; 2], EvaluationFailure> {
        let in_range_camera = parameters.pose(0)?.inverse_transform(parameters.values(1)?);
        let [x, y, z] = parameters.pose(2)?.inverse_transform(in_range_camera);
        let camera: [T; CAMERA_VALUES] = parameters.values(3)?;
        let point = Vector3::new(x.value(), y.value(), z.value());
        let model = image_model(&self.camera, &camera.map(T::value), &point, true)?;
        Ok([0, 1].map(|axis| {
            let by_point = std::array::from_fn(|coordinate| model.by_camera_point[(axis, coordinate)]);
            let by_camera = std::array::from_fn(|value| model.by_camera[axis][value]);
            let of_point = T::function_of([x, y, z], model.pixel[axis], by_point);
            -(of_point + T::function_of(camera, 0.0, by_camera)) + self.pixel[axis]
        }))
    }
}

/// A distance known from outside, between perspective centres or targets, metre.
#[derive(Debug, Clone)]
pub(crate) struct KnownLength(pub(crate) f64);

impl ResidualFunction<1> for KnownLength {
    fn residual<T: Real>(&self, parameters: &Parameters<'_, T>) -> Result<[T; 1], EvaluationFailure> {
        let end = |block| parameters.values(block).or_else(|_| Ok(parameters.pose(block)?.translation()));
        let ([ax, ay, az], [bx, by, bz]): ([T; 3], [T; 3]) = (end(0)?, end(1)?);
        let length = ((bx - ax).powi(2) + (by - ay).powi(2) + (bz - az).powi(2)).sqrt();
        if length.value() <= 0.0 {
            return Err(EvaluationFailure::new("both ends of a known distance are one point"));
        }
        Ok([-length + self.0])
    }
}

/// Some parameters of a block, known before with a covariance.
#[derive(Debug, Clone)]
pub struct PartialPrior {
    /// The block, of which some components are observed.
    pub block: [BlockId; 1],
    /// Which components, and their values.
    pub known: Vec<(usize, f64)>,
}

impl Observation for PartialPrior {
    fn dimension(&self) -> usize {
        self.known.len()
    }

    fn blocks(&self) -> &[BlockId] {
        &self.block
    }

    fn evaluate(
        &self,
        parameters: &[&[f64]],
        residual: &mut [f64],
        mut jacobians: Option<&mut Jacobians<'_>>,
    ) -> Result<(), EvaluationFailure> {
        for (row, (component, value)) in self.known.iter().enumerate() {
            let current = parameters[0].get(*component).copied();
            residual[row] = value - current.ok_or_else(|| EvaluationFailure::new("a prior beyond its block"))?;
            if let Some(jacobians) = jacobians.as_deref_mut()
                && let Some(entry) = jacobians.row(0, row).get_mut(*component)
            {
                *entry = 1.0;
            }
        }
        Ok(())
    }
}

/// The pose of a passive camera in the world.
pub(crate) fn world_from_passive(
    world_from_camera: &Isometry3<f64>,
    range_camera_from_passive: &Isometry3<f64>,
) -> Isometry3<f64> {
    world_from_camera * range_camera_from_passive
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use adjust::{Adjustment, Differentiated, ParameterBlock, check_jacobian};
    use camera_model::{ImageFormat, InteriorOrientation, LensDistortion};
    use error_models::{AmplitudeHyperbola, RangeTerms};

    use super::*;
    use crate::functional_model::hyperbola_steps::range_block;
    use crate::functional_model::terms::{camera_values, family_widths, range_values};

    fn camera() -> Camera {
        let interior = InteriorOrientation { principal_point_mm: [0.06, -0.04], principal_distance_mm: 8.0 };
        let lens = LensDistortion { k1: -2e-3, k2: 4e-5, k3: -3e-7, p1: 3e-4, p2: -2e-4, ..LensDistortion::default() };
        Camera::new(ImageFormat::new(176, 144, [0.04, 0.035]).unwrap(), interior, lens).unwrap()
    }

    fn model() -> RangeErrorModel {
        let terms = RangeTerms { d0: 0.03, periodic: [0.02, -0.01, 0.01, 0.02, -0.02, 0.01], e1: 2e-3, e2: -1e-3 };
        let hyperbola = AmplitudeHyperbola { h1: -1e-3, h2: 0.5, h3: 4.0, amplitude_span: [0.0, 1e4] };
        RangeErrorModel { terms, hyperbola: Some(hyperbola), ..RangeErrorModel::error_free(5.0) }
    }

    /// Pose, target 2 m in front of it, camera, range set.
    fn blocks() -> Vec<ParameterBlock> {
        let pose = Isometry3::new(Vector3::new(0.4, -0.3, 1.9), Vector3::new(0.1, -0.2, 0.7));
        let target: [f64; 3] = (pose * Point3::new(0.5, 0.3, -2.0)).into();
        vec![
            ParameterBlock::pose(&pose),
            ParameterBlock::euclidean(target),
            ParameterBlock::euclidean(camera_values(&camera())),
            ParameterBlock::euclidean(range_values(&model())),
        ]
    }

    fn ids(count: usize) -> Vec<BlockId> {
        let mut adjustment = Adjustment::new();
        (0..count).map(|_| adjustment.add_block(ParameterBlock::euclidean([0.0]))).collect()
    }

    #[test]
    fn derivatives_of_a_sighting() {
        let model = Arc::new(model());
        let widths = family_widths(&model).into();
        let range =
            RangeEquation { range_m: 2.15, amplitude: 300.0, drift_m: 0.02, model, widths, natural_steps: false };
        let rig_from_camera = Isometry3::new(Vector3::new(0.2, 0.05, -0.1), Vector3::new(0.03, -0.1, 0.2));
        for (uses_pixel, range) in [(true, Some(range.clone())), (true, None), (false, Some(range))] {
            for is_mounted in [false, true] {
                let mut blocks = if range.is_some() { blocks() } else { blocks()[..3].to_vec() };
                if is_mounted {
                    let pose = Isometry3::new(Vector3::new(0.4, -0.3, 1.9), Vector3::new(0.1, -0.2, 0.7));
                    blocks[0] = ParameterBlock::pose(&(pose * rig_from_camera.inverse()));
                    blocks.push(ParameterBlock::pose(&rig_from_camera));
                }
                let (ids, pixel, range) = (ids(blocks.len()), [120.3, 31.8], range.clone());
                let equation = SightingEquation { blocks: ids, camera: camera(), pixel, uses_pixel, range, is_mounted };
                let check = check_jacobian(&equation, &blocks).unwrap();
                // Steps follow the largest value of a block (h3 = 4), for which the short waves are far from linear:
                // the differences agree among themselves to some 1e-6. A wrong factor would show as 1e-2.
                assert!(check.worst < 1e-5, "{check:?}");
            }
        }
    }

    #[test]
    fn derivatives_by_the_steps_of_a_hyperbola() {
        let model = Arc::new(model());
        let mut blocks = blocks();
        blocks[3] = range_block(&model, &AmplitudeHyperbola::NAMES.map(str::to_owned).into());
        let widths = family_widths(&model).into();
        let range =
            RangeEquation { range_m: 2.15, amplitude: 300.0, drift_m: 0.02, model, widths, natural_steps: true };
        let (camera, pixel) = (camera(), [120.3, 31.8]);
        let (uses_pixel, is_mounted) = (true, false);
        let range = Some(range);
        let equation = SightingEquation { blocks: ids(4), camera, pixel, uses_pixel, range, is_mounted };
        let check = check_jacobian(&equation, &blocks).unwrap();
        assert!(check.worst < 1e-5, "{check:?}");
    }

    #[test]
    fn derivatives_of_a_passive_image_point_and_a_distance() {
        let relative = Isometry3::new(Vector3::new(0.1, 0.02, -0.03), Vector3::new(0.02, -0.03, 0.1));
        let [pose, target, camera_block, _] = <[ParameterBlock; 4]>::try_from(blocks()).unwrap();
        let all = [pose.clone(), target.clone(), ParameterBlock::pose(&relative), camera_block];
        let function = PassivePoint { camera: camera(), pixel: [120.3, 31.8] };
        let equation = Differentiated::new(&all, ids(4), function).unwrap();
        let check = check_jacobian(&equation, &all).unwrap();
        assert!(check.worst < 1e-6, "{check:?}");
        let equation = Differentiated::new(&all, ids(2), KnownLength(2.0)).unwrap();
        let check = check_jacobian(&equation, &[pose, target]).unwrap();
        assert!(check.worst < 1e-6, "{check:?}");
    }
}
