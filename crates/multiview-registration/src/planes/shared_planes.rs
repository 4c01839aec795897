//! Shared planes: the planes that several stations saw pieces of, each station's regions joined where they meet.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, Vector3};

use crate::error::Result;
use crate::planes::contacts::Contact;
use crate::planes::reduction::PairContacts;
use crate::planes::tiles::Tiles;
use crate::surfaces::extents::Extent;
use crate::surfaces::patches::{Surface, axes};
use crate::surfaces::plane_fit::{Moments, SAME_DIRECTION};
use crate::surfaces::regions::{OFF_PLANE, ROUGHER};
use point_cloud::NeighbourTree;

/// How far patches of neighbouring pieces of a plane may be apart, patches.
const BESIDE: f64 = 2.0;

/// A plane with what is known of its extent.
#[derive(Debug, Clone)]
pub(crate) struct SharedPlane {
    pub origin: Vector3<f64>,
    pub normal: Vector3<f64>,
    pub right: Vector3<f64>,
    pub up: Vector3<f64>,
    pub tiles: Tiles,
    /// Number of its patches.
    pub size: usize,
    /// Points of a small shared plane (station, index in its cloud), which alone belong to it; empty for a wide one, to which
    /// every point on it does.
    pub points: Vec<(u32, u32)>,
}

impl SharedPlane {
    pub(crate) fn new(origin: Vector3<f64>, normal: Vector3<f64>) -> Self {
        let (right, up) = axes(&normal);
        Self { origin, normal, right, up, tiles: Tiles::default(), size: 0, points: Vec::new() }
    }

    /// Coordinates of a point in the plane.
    pub(crate) fn place(&self, point: &Vector3<f64>) -> [f64; 2] {
        let apart = point - self.origin;
        [self.right.dot(&apart), self.up.dot(&apart)]
    }

    /// The box about its tiles.
    pub(crate) fn extent(&self) -> Extent {
        let [across, along] = self.tiles.ends();
        let corner = |(u, v): (f64, f64)| Point3::from(self.origin + self.right * u + self.up * v);
        Extent::of(across.into_iter().flat_map(|u| along.map(|v| (u, v))).map(corner))
    }

    /// Moves the plane by an offset and two slopes.
    pub(crate) fn moved(&mut self, step: &Vector3<f64>) {
        self.origin += self.normal * step[0];
        self.normal = (self.normal - self.right * step[1] - self.up * step[2]).normalize();
        self.right = (self.right - self.normal * self.normal.dot(&self.right)).normalize();
        self.up = self.normal.cross(&self.right);
    }
}

/// Joins the surfaces of all stations at these poses; partners may be `tolerance_m` apart because the poses are off.
pub(crate) fn shared_planes(
    surfaces: &[&Surface],
    poses: &[Isometry3<f64>],
    pairs_in_contact: &[PairContacts],
    tolerance_m: f64,
) -> Result<Vec<SharedPlane>> {
    let Some(first) = poses.first() else { return Ok(Vec::new()) };
    let mut joined = Joined::new(surfaces, poses, first.translation.vector, tolerance_m);
    joined.join_regions(pairs_in_contact);
    joined.join_neighbours()?;
    let mut shared_plane_of = joined.adopt_patches(pairs_in_contact);
    let mut shared_planes = joined.wide(&shared_plane_of);
    joined.small(pairs_in_contact, &mut shared_plane_of, &mut shared_planes);
    let mut tiles = 0;
    for shared_plane in &mut shared_planes {
        shared_plane.tiles.first = tiles;
        tiles += shared_plane.tiles.len();
    }
    Ok(shared_planes)
}

/// Regions as a forest: those of one tree are one plane.
struct Joined<'a> {
    surfaces: &'a [&'a Surface],
    poses: &'a [Isometry3<f64>],
    centre: Vector3<f64>,
    tolerance_m: f64,
    first: Vec<usize>,
    parent: Vec<usize>,
    /// About `centre`, of the roots.
    moments: Vec<Moments>,
    normals: Vec<Vector3<f64>>,
}

impl<'a> Joined<'a> {
    fn new(surfaces: &'a [&'a Surface], poses: &'a [Isometry3<f64>], centre: Vector3<f64>, tolerance_m: f64) -> Self {
        let (mut first, mut moments, mut normals) = (Vec::new(), Vec::new(), Vec::new());
        for (surface, pose) in surfaces.iter().zip(poses) {
            first.push(moments.len());
            moments.extend(surface.regions.iter().map(|region| region.moments.moved(&surface.origin, pose, &centre)));
            let mut own = vec![Vector3::zeros(); surface.regions.len()];
            for (patch, region) in surface.patches.iter().zip(&surface.region_of) {
                if let Some(region) = region {
                    own[*region] += pose.rotation * patch.normal;
                }
            }
            normals.extend(own);
        }
        let parent = (0..moments.len()).collect();
        Self { surfaces, poses, centre, tolerance_m, first, parent, moments, normals }
    }

    fn root(&self, node: usize) -> usize {
        root(&self.parent, node)
    }

    fn node(&self, station: usize, patch: u32) -> Option<usize> {
        self.surfaces[station].region_of[patch as usize].map(|region| self.first[station] + region)
    }

    /// Joins regions that meet, those that meet in the most places first.
    fn join_regions(&mut self, pairs_in_contact: &[PairContacts]) {
        let mut met: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        for (a, b) in ends(pairs_in_contact) {
            if let (Some(a), Some(b)) = (self.node(a.0, a.1), self.node(b.0, b.1)) {
                *met.entry((a.min(b), a.max(b))).or_default() += 1;
            }
        }
        let mut met: Vec<((usize, usize), usize)> = met.into_iter().collect();
        met.sort_by_key(|&(nodes, count)| (std::cmp::Reverse(count), nodes));
        for ((a, b), _) in met {
            self.join(a, b);
        }
    }

    /// Joins pieces of a plane that lie beside each other: what stands before a wall divides it for each station.
    fn join_neighbours(&mut self) -> Result<()> {
        let mut centres: BTreeMap<usize, Vec<Point3<f64>>> = BTreeMap::new();
        for (station, surface) in self.surfaces.iter().enumerate() {
            for (patch, place) in surface.patches.iter().enumerate() {
                if let Some(node) = self.node(station, patch as u32) {
                    centres.entry(self.root(node)).or_default().push(self.poses[station] * place.centre);
                }
            }
        }
        let reach_m = BESIDE * self.size_m();
        let piece = |(root, centres)| Ok((root, Piece::new(centres)?));
        let pieces: Vec<(usize, Piece)> = centres.into_iter().map(piece).collect::<Result<_>>()?;
        let extents: Vec<Extent> = pieces.iter().map(|(_, piece)| piece.extent).collect();
        for (a, b) in Extent::pairs(&extents, reach_m) {
            let ((a, first_piece), (b, second_piece)) = (&pieces[a], &pieces[b]);
            let (first, second) = (self.normals[self.root(*a)], self.normals[self.root(*b)]);
            if self.root(*a) != self.root(*b)
                && first.dot(&second) >= SAME_DIRECTION * first.norm() * second.norm()
                && first_piece.is_beside(second_piece, reach_m)
            {
                self.join(*a, *b);
            }
        }
        Ok(())
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        if a == b || !self.one_plane(a, b) {
            return;
        }
        let (into, from) = if self.moments[a].count() >= self.moments[b].count() { (a, b) } else { (b, a) };
        let (moments, normal) = (self.moments[from], self.normals[from]);
        self.moments[into].join(&moments);
        self.normals[into] += normal;
        self.parent[from] = into;
    }

    fn one_plane(&self, a: usize, b: usize) -> bool {
        let (wide, small) = if self.moments[a].count() >= self.moments[b].count() { (a, b) } else { (b, a) };
        let (wide, small) = (&self.moments[wide], &self.moments[small]);
        let mut both = *wide;
        both.join(small);
        let (Some(plane), Some(own), Some(joint)) = (wide.region_plane(), small.region_plane(), both.region_plane())
        else {
            return false;
        };
        let apart = small.mean() - wide.mean();
        let of_plane = plane.variance / wide.count() * (1.0 + apart.norm_squared() / plane.spread);
        let about = plane.normal.dot(&(small.scatter() * plane.normal)) + plane.normal.dot(&apart).powi(2);
        let off = self.tolerance_m.powi(2);
        let parts = (wide.count() * plane.variance + small.count() * own.variance) / both.count();
        plane.normal.dot(&own.normal).abs() >= SAME_DIRECTION
            && about <= ROUGHER * own.variance + OFF_PLANE.powi(2) * of_plane + off
            && joint.variance <= ROUGHER * parts + off
    }

    /// The root that each patch belongs to: that of its region, or of a partner in whose plane it lies.
    fn adopt_patches(&self, pairs_in_contact: &[PairContacts]) -> Vec<Vec<Option<usize>>> {
        let own = |(station, surface): (usize, &&Surface)| -> Vec<Option<usize>> {
            (0..surface.patches.len()).map(|patch| self.node(station, patch as u32).map(|n| self.root(n))).collect()
        };
        let mut shared_plane_of: Vec<Vec<Option<usize>>> = self.surfaces.iter().enumerate().map(own).collect();
        for (a, b) in ends(pairs_in_contact) {
            for ((station, patch), other) in [(a, b), (b, a)] {
                let Some(root) = shared_plane_of[other.0][other.1 as usize] else { continue };
                if shared_plane_of[station][patch as usize].is_none() && self.lies_in(station, patch, root) {
                    shared_plane_of[station][patch as usize] = Some(root);
                }
            }
        }
        shared_plane_of
    }

    fn lies_in(&self, station: usize, patch: u32, root: usize) -> bool {
        let (pose, patch) = (&self.poses[station], &self.surfaces[station].patches[patch as usize]);
        let Some(plane) = self.moments[root].region_plane() else { return false };
        let apart = (pose * patch.centre).coords - self.centre - self.moments[root].mean();
        let across = plane.normal.dot(&apart).abs();
        across <= OFF_PLANE * patch.variance.sqrt() + self.tolerance_m
            && plane.normal.dot(&(pose.rotation * patch.normal)).abs() >= SAME_DIRECTION
    }

    fn size_m(&self) -> f64 {
        self.surfaces.iter().map(|surface| surface.size_m).fold(0.0, f64::max)
    }

    /// One shared plane a root.
    fn wide(&self, shared_plane_of: &[Vec<Option<usize>>]) -> Vec<SharedPlane> {
        let mut places: BTreeMap<usize, (SharedPlane, Vec<[f64; 2]>)> = BTreeMap::new();
        for (station, of_patches) in shared_plane_of.iter().enumerate() {
            for (patch, root) in of_patches.iter().enumerate() {
                let Some(root) = *root else { continue };
                let centre = (self.poses[station] * self.surfaces[station].patches[patch].centre).coords;
                let entry = places.entry(root).or_insert_with(|| (self.shared_plane(root), Vec::new()));
                let place = entry.0.place(&centre);
                entry.1.push(place);
            }
        }
        let size_m = self.size_m();
        let with_tiles = |(mut shared_plane, places): (SharedPlane, Vec<[f64; 2]>)| {
            shared_plane.size = places.len();
            shared_plane.tiles = Tiles::around(&places, size_m);
            shared_plane
        };
        places.into_values().map(with_tiles).collect()
    }

    fn shared_plane(&self, root: usize) -> SharedPlane {
        let moments = &self.moments[root];
        let normal = moments.region_plane().map_or(Vector3::z(), |plane| plane.normal);
        let normal = if normal.dot(&self.normals[root]) < 0.0 { -normal } else { normal };
        SharedPlane::new(self.centre + moments.mean(), normal)
    }

    /// Patches of several stations that meet and belong to no wide shared plane: one small shared plane each.
    fn small(
        &self,
        pairs_in_contact: &[PairContacts],
        shared_plane_of: &mut [Vec<Option<usize>>],
        shared_planes: &mut Vec<SharedPlane>,
    ) {
        let mut partners: BTreeMap<(u32, u32), Vec<(u32, u32)>> = BTreeMap::new();
        for (a, b) in ends(pairs_in_contact) {
            if shared_plane_of[a.0][a.1 as usize].is_none() && shared_plane_of[b.0][b.1 as usize].is_none() {
                let (a, b) = ((a.0 as u32, a.1), (b.0 as u32, b.1));
                partners.entry(a).or_default().push(b);
                partners.entry(b).or_default().push(a);
            }
        }
        for (patch, others) in partners {
            let free = |(station, patch): (u32, u32)| shared_plane_of[station as usize][patch as usize].is_none();
            let mut members = vec![patch];
            members.extend(others.into_iter().filter(|&other| free(other)));
            members.sort_unstable();
            members.dedup();
            if !free(patch) || members.len() < 2 {
                continue;
            }
            let mut moments = Moments::default();
            for &(station, patch) in &members {
                let (surface, pose) = (self.surfaces[station as usize], &self.poses[station as usize]);
                moments.join(&surface.moments[patch as usize].moved(&surface.origin, pose, &self.centre));
                shared_plane_of[station as usize][patch as usize] = Some(usize::MAX);
            }
            let Some(plane) = moments.plane() else { continue };
            let mut shared_plane = SharedPlane::new(self.centre + moments.mean(), plane.normal);
            shared_plane.tiles = Tiles::one(self.size_m());
            shared_plane.size = members.len();
            let points_of = |&(station, patch): &(u32, u32)| {
                let points = self.surfaces[station as usize].points_of(patch as usize);
                points.iter().map(move |&point| (station, point))
            };
            shared_plane.points = members.iter().flat_map(points_of).collect();
            shared_planes.push(shared_plane);
        }
    }
}

/// The root of the tree that a node of a forest belongs to.
pub(crate) fn root(parent: &[usize], mut node: usize) -> usize {
    while parent[node] != node {
        node = parent[node];
    }
    node
}

/// The patches of one piece of a plane.
struct Piece {
    centres: Vec<Point3<f64>>,
    tree: NeighbourTree,
    extent: Extent,
}

impl Piece {
    fn new(centres: Vec<Point3<f64>>) -> Result<Self> {
        let tree = NeighbourTree::new(&centres)?;
        Ok(Self { extent: Extent::of(centres.iter().copied()), centres, tree })
    }

    /// Whether a patch of the one is in reach of a patch of the other.
    fn is_beside(&self, other: &Self, reach_m: f64) -> bool {
        let (few, many) = if self.centres.len() <= other.centres.len() { (self, other) } else { (other, self) };
        let mut near = few.centres.iter().filter(|centre| many.extent.is_near(&centre.coords, reach_m));
        near.any(|centre| many.tree.any_nearest(&centre.coords.into()).distance_m <= reach_m)
    }
}

/// Both ends of all contacts, as stations and patches.
fn ends(pairs_in_contact: &[PairContacts]) -> impl Iterator<Item = ((usize, u32), (usize, u32))> {
    let of = |pair_contacts: &PairContacts, contact: &Contact| {
        ((pair_contacts.source, contact.source), (pair_contacts.target, contact.target))
    };
    pairs_in_contact
        .iter()
        .flat_map(move |pair_contacts| pair_contacts.contacts.iter().map(move |contact| of(pair_contacts, contact)))
}
