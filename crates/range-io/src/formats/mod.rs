//! One module a file format of pictures and clouds.

#[cfg(feature = "clouds")]
pub(crate) mod any_cloud;
#[cfg(feature = "azure")]
pub mod azure;
#[cfg(any(feature = "e57", feature = "pcd", feature = "ply", feature = "vtk", feature = "xyz"))]
pub(crate) mod cloud_file;
#[cfg(feature = "e57")]
pub mod e57;
#[cfg(any(feature = "grey", feature = "png16"))]
pub mod images;
#[cfg(feature = "mkv")]
pub mod mkv;
#[cfg(feature = "npz")]
pub mod npz;
#[cfg(feature = "pcd")]
pub mod pcd;
#[cfg(feature = "ply")]
pub mod ply;
#[cfg(feature = "vtk")]
pub mod vtk;
#[cfg(feature = "xyz")]
pub mod xyz;
