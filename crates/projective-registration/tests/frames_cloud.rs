//! The nodes of an organised frame as a cloud.

use crate::common::{Pinhole, Scene, frame, look_at, sigma_of};
use crate::prepared::{pinhole, prepared};

#[test]
fn the_cloud_of_a_frame_lies_on_its_surfaces() {
    let camera = Pinhole::small();
    let projection = pinhole(&camera);
    let scene = Scene::furnished();
    let pose = look_at([0.8, -0.5, 1.4], [-2.0, 1.4, 0.6]);
    let cloud = prepared(&projection, &frame(&scene, &camera, &pose, 0.0, 1)).to_cloud();
    let (normals, rim) = (cloud.normals.as_ref().unwrap(), cloud.rim.as_ref().unwrap());
    let sigma = cloud.sigma.as_ref().unwrap();
    let (mut kept, mut off) = (0, 0);
    for (k, p) in cloud.points.iter().enumerate() {
        // Nodes are single pixels here; single precision.
        assert!((sigma[k] / sigma_of(p.coords.norm()) - 1.0).abs() < 1e-5, "{k}: {}", sigma[k]);
        if rim[k] {
            assert!(normals[k].x.is_nan());
            continue;
        }
        kept += 1;
        let range = scene.range(&pose.translation.vector, &(pose.rotation * p.coords.normalize()));
        // Averages over squares of pixels round creases by a fraction of their size, 3 cm.
        off += usize::from((p.coords.norm() - range).abs() > 0.01);
        assert!(normals[k].dot(&p.coords) < 0.0 && (normals[k].norm() - 1.0).abs() < 1e-12);
    }
    // Squares across a jump can look like a steep plane.
    assert!(off * 200 < kept, "{off} of {kept}");
    assert!(kept > cloud.len() / 2);
}
