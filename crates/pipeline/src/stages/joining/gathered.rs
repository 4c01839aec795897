//! What registration keeps of the stations as they come: points with normals, few enough to hold those of all.

use std::sync::Arc;
use std::time::Instant;

use camera_model::Camera;
use multiview_registration::PairAlignment;
use nalgebra::Isometry3;
use point_cloud::Cloud;
use projective_registration::{OrganisedFrame, Projection};
use rayon::prelude::*;

use crate::stations::station::{Station, Windows, projection};
use crate::stations::surface::{self, Start, Surface};
use crate::survey::open::OpenSurvey;
use crate::survey::view::View;
use crate::{Error, Result};
use commands::plan::{RegisterOptions, StartPoses};

/// Of a point here, and twice as much in the adjustment.
const BYTES_A_POINT: u64 = 210;

/// Points of all stations together, about. A survey of fewer,
/// 100 stations of 176 x 144 pixels, keeps all; of more, each station is thinned evenly once it has its normals: patches
/// grow as points become fewer.
const MOST_POINTS: usize = 2_500_000;

/// Stations that are prepared at once.
const AT_ONCE: usize = 4;

/// The stations so far.
pub(crate) struct Gathered {
    options: RegisterOptions,
    projection: Option<Arc<Projection>>,
    windows: Windows,
    /// Of so many points of a station one is kept; pixels of all stations.
    stride: usize,
    pixels: usize,
    pending: Vec<Station>,
    pub(crate) names: Vec<String>,
    /// Where the survey says that they stand.
    pub(crate) stated: Vec<Option<Isometry3<f64>>>,
    pub(crate) clouds: Vec<Cloud>,
    /// The stations as frames, where they have no amplitudes.
    pub(crate) frames: Vec<OrganisedFrame>,
    /// Of neighbours that are aligned one onto the other: the last one, and what was found.
    last: Option<Surface>,
    pub(crate) pairs: Vec<PairAlignment>,
    /// Why a station cannot be registered.
    pub(crate) failed: Option<Error>,
    /// Time that it took, second.
    pub(crate) seconds: f64,
}

impl Gathered {
    /// For so many views of the survey, whose clouds are made by this camera.
    pub(crate) fn new(options: &RegisterOptions, survey: &OpenSurvey, camera: &Camera, views: usize) -> Self {
        let frames = || survey.survey.frames.iter();
        let has_poses = options.start == StartPoses::Approximate
            && frames().all(|frame| survey.approximate_pose(&frame.station).is_some());
        let pixels = views * camera.format.width * camera.format.height;
        Self {
            options: options.clone(),
            projection: projection(camera),
            windows: Windows::of_start(has_poses),
            stride: pixels.div_ceil(MOST_POINTS).max(1),
            pixels,
            pending: Vec::new(),
            names: Vec::new(),
            stated: Vec::new(),
            clouds: Vec::new(),
            frames: Vec::new(),
            last: None,
            pairs: Vec::new(),
            failed: None,
            seconds: 0.0,
        }
    }

    /// What the stations take until they are adjusted, byte.
    pub(crate) fn bytes(&self) -> u64 {
        BYTES_A_POINT * (self.pixels / self.stride) as u64
    }

    /// Adds a view with its cloud.
    pub(crate) fn add(&mut self, view: &View, survey: &OpenSurvey) {
        let clock = Instant::now();
        let station = Station::of_view(view, &survey.stated, self.projection.as_ref());
        self.pending.extend(station.filter(|_| self.failed.is_none()));
        if self.pending.len() == AT_ONCE {
            self.prepare();
        }
        self.seconds += clock.elapsed().as_secs_f64();
    }

    /// Prepares what waits.
    pub(crate) fn prepare(&mut self) {
        let stations = std::mem::take(&mut self.pending);
        if stations.is_empty() {
            return;
        }
        self.names.extend(stations.iter().map(|station| station.name.clone()));
        self.stated.extend(stations.iter().map(|station| station.approximate));
        let done = match self.options.start {
            StartPoses::Neighbour => self.align(&stations),
            StartPoses::Approximate | StartPoses::Order => self.keep(&stations),
        };
        if let Err(error) = done {
            self.failed.get_or_insert(error);
        }
    }

    fn keep(&mut self, stations: &[Station]) -> Result<()> {
        let (half_width_px, windows) = (self.options.normal_half_width_px, self.windows);
        let frame = |station: &Station| surface::frame(station, station.projection.as_ref()?);
        self.frames.par_extend(stations.par_iter().filter(|station| station.is_depth_alone()).filter_map(frame));
        let clouds = stations.par_iter().map(|station| station.cloud(half_width_px, windows));
        let clouds = clouds.collect::<Result<Vec<Cloud>>>()?;
        self.clouds.extend(clouds.into_iter().map(|cloud| thinned(cloud, self.stride)));
        Ok(())
    }

    /// Aligns each station onto the one before.
    fn align(&mut self, stations: &[Station]) -> Result<()> {
        let first = self.clouds.len();
        let half_width_px = self.options.normal_half_width_px;
        let surfaces = stations.par_iter().map(|station| Surface::new(station, half_width_px));
        let surfaces = surfaces.collect::<Result<Vec<_>>>()?;
        self.clouds.extend(surfaces.iter().map(|surface| thinned(surface.target.cloud().clone(), self.stride)));
        let before = usize::from(self.last.is_some());
        let surfaces: Vec<Surface> = self.last.take().into_iter().chain(surfaces).collect();
        let align = |place: usize| {
            let source = first + 1 - before + place;
            let target = source - 1;
            let start = Start::Found(Isometry3::identity(), self.options.maximum_distance_m);
            let result = surfaces[place].align(&surfaces[place + 1], start);
            let names = format!("{} onto {}", self.names[source], self.names[target]);
            Ok(PairAlignment { target, source, result: result.map_err(Error::stage("Register", &names))? })
        };
        for pair in (0..surfaces.len() - 1).into_par_iter().map(align).collect::<Vec<Result<_>>>() {
            self.pairs.push(pair?);
        }
        self.last = surfaces.into_iter().next_back();
        Ok(())
    }
}

/// Every so-many-th point of a cloud.
fn thinned(cloud: Cloud, stride: usize) -> Cloud {
    fn some<T: Copy>(values: &[T], stride: usize) -> Vec<T> {
        values.iter().step_by(stride).copied().collect()
    }
    if stride == 1 {
        return cloud;
    }
    Cloud {
        points: some(&cloud.points, stride),
        normals: cloud.normals.map(|normals| some(&normals, stride)),
        sigma: cloud.sigma.map(|sigma| some(&sigma, stride)),
        intensity: cloud.intensity.map(|intensity| some(&intensity, stride)),
        rim: cloud.rim.map(|rim| some(&rim, stride)),
    }
}
