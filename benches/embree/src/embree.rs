//! As much of Embree 3's C interface as one mesh and single rays need.

use halflight::rays::Ray;
use halflight::scene::Mesh;
use std::ffi::{c_char, c_int, c_void};

/// `RTCRay`.
#[repr(C, align(16))]
#[derive(Clone, Copy)]
struct RtcRay {
    origin: [f32; 3],
    t_near: f32,
    direction: [f32; 3],
    time: f32,
    t_far: f32,
    mask: u32,
    id: u32,
    flags: u32,
}

/// `RTCRayHit`.
#[repr(C, align(16))]
struct RtcRayHit {
    ray: RtcRay,
    normal: [f32; 3],
    u: f32,
    v: f32,
    primitive: u32,
    geometry: u32,
    instance: u32,
}

/// `RTCIntersectContext`, and room for what some builds add to it.
#[repr(C, align(16))]
struct Context {
    flags: c_int,
    filter: *const c_void,
    instance: [u32; 8],
}

unsafe extern "C" {
    fn rtcNewDevice(config: *const c_char) -> *mut c_void;
    fn rtcNewScene(device: *mut c_void) -> *mut c_void;
    fn rtcSetSceneBuildQuality(scene: *mut c_void, quality: c_int);
    fn rtcNewGeometry(device: *mut c_void, kind: c_int) -> *mut c_void;
    fn rtcSetNewGeometryBuffer(
        geometry: *mut c_void,
        kind: c_int,
        slot: u32,
        format: c_int,
        stride: usize,
        count: usize,
    ) -> *mut c_void;
    fn rtcCommitGeometry(geometry: *mut c_void);
    fn rtcAttachGeometry(scene: *mut c_void, geometry: *mut c_void) -> u32;
    fn rtcCommitScene(scene: *mut c_void);
    fn rtcIntersect1(scene: *mut c_void, context: *mut Context, hit: *mut RtcRayHit);
    fn rtcOccluded1(scene: *mut c_void, context: *mut Context, ray: *mut RtcRay);
}

const QUALITY_HIGH: c_int = 2;
const TRIANGLES: c_int = 0;
const INDICES: c_int = 0;
const VERTICES: c_int = 1;
const UINT3: c_int = 0x5003;
const FLOAT3: c_int = 0x9003;
const NONE: u32 = u32::MAX;

/// A committed scene of one mesh. It lives as long as the program.
pub struct Scene(*mut c_void);

impl Scene {
    pub fn new(mesh: &Mesh) -> Self {
        // SAFETY: calls in the order and with the sizes that Embree's manual asks for; buffers are as long as what is
        // copied into them.
        unsafe {
            let device = rtcNewDevice(std::ptr::null());
            let scene = rtcNewScene(device);
            rtcSetSceneBuildQuality(scene, QUALITY_HIGH);
            let geometry = rtcNewGeometry(device, TRIANGLES);
            let (points, faces) = (&mesh.positions, &mesh.triangles);
            let buffer = rtcSetNewGeometryBuffer(geometry, VERTICES, 0, FLOAT3, 12, points.len());
            buffer.cast::<[f32; 3]>().copy_from_nonoverlapping(points.as_ptr().cast(), points.len());
            let buffer = rtcSetNewGeometryBuffer(geometry, INDICES, 0, UINT3, 12, faces.len());
            buffer.cast::<[u32; 3]>().copy_from_nonoverlapping(faces.as_ptr(), faces.len());
            rtcCommitGeometry(geometry);
            rtcAttachGeometry(scene, geometry);
            rtcCommitScene(scene);
            Self(scene)
        }
    }

    /// The distance of the first hit; infinity where there is none.
    pub fn closest(&self, ray: &Ray) -> f32 {
        let mut hit = RtcRayHit {
            ray: rtc_ray(ray),
            normal: [0.0; 3],
            u: 0.0,
            v: 0.0,
            primitive: NONE,
            geometry: NONE,
            instance: NONE,
        };
        // SAFETY: the scene is committed, the structures are laid out as in rtcore_ray.h and aligned.
        unsafe { rtcIntersect1(self.0, &mut context(), &mut hit) };
        if hit.geometry == NONE { f32::INFINITY } else { hit.ray.t_far }
    }

    /// Whether anything lies on the ray.
    pub fn occluded(&self, ray: &Ray) -> bool {
        let mut ray = rtc_ray(ray);
        // SAFETY: as above.
        unsafe { rtcOccluded1(self.0, &mut context(), &mut ray) };
        ray.t_far < 0.0
    }
}

fn rtc_ray(ray: &Ray) -> RtcRay {
    RtcRay {
        origin: ray.origin.to_array(),
        t_near: 0.0,
        direction: ray.direction.to_array(),
        time: 0.0,
        t_far: ray.t_max,
        mask: u32::MAX,
        id: 0,
        flags: 0,
    }
}

fn context() -> Context {
    Context { flags: 0, filter: std::ptr::null(), instance: [NONE; 8] }
}
