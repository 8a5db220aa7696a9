use glam::Vec3;

/// Unpolarised Fresnel reflectance of a smooth dielectric interface, in [0, 1].
///
/// `cos_from` in [0, 1]: cosine at the incoming side; `eta`: refractive index of the far side over that of the
/// near side, > 0. One for total reflection. Born & Wolf 1999, §1.5.2.
pub fn fresnel_dielectric(cos_from: f32, eta: f32) -> f32 {
    let sin2_to = (1.0 - cos_from * cos_from).max(0.0) / (eta * eta);
    if sin2_to >= 1.0 {
        return 1.0;
    }
    let cos_to = (1.0 - sin2_to).sqrt();
    let parallel = (eta * cos_from - cos_to) / (eta * cos_from + cos_to);
    let perpendicular = (cos_from - eta * cos_to) / (cos_from + eta * cos_to);
    if cos_from == 0.0 {
        return 1.0; // grazing light: the limit, where eta = 1 would read 0/0
    }
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// The refracted direction (unit, away from the surface, on the far side of `normal`), Snell's law.
///
/// `normal` is a unit normal on the side of `from`; `eta` as in [`fresnel_dielectric`]. None: total reflection.
pub fn refract(from: Vec3, normal: Vec3, eta: f32) -> Option<Vec3> {
    let cos_from = from.dot(normal);
    let sin2_to = (1.0 - cos_from * cos_from).max(0.0) / (eta * eta);
    if sin2_to >= 1.0 {
        return None;
    }
    let cos_to = (1.0 - sin2_to).sqrt();
    Some((-from / eta + (cos_from / eta - cos_to) * normal).normalize())
}

/// The refractive index of one colour (0 red, 1 green, 2 blue) of glass with this `dispersion`, 20 over Abbe's number V: the index
/// is that of green, and n_blue − n_red = (n − 1) / V (KHR_materials_dispersion). None: that of all alike.
pub fn dispersed(ior: f32, dispersion: f32, colour: Option<usize>) -> f32 {
    let half_spread = (ior - 1.0) * 0.025 * dispersion;
    match colour {
        Some(colour) => ior + (colour as f32 - 1.0) * half_spread,
        None => ior,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_incidence_is_the_textbook_value() {
        assert!((fresnel_dielectric(1.0, 1.5) - 0.04).abs() < 1e-6);
        assert!((fresnel_dielectric(1.0, 1.0 / 1.5) - 0.04).abs() < 1e-6);
    }

    #[test]
    fn equal_indices_reflect_nothing_and_bend_nothing() {
        let from = Vec3::new(0.6, 0.8, 0.0);
        assert_eq!(fresnel_dielectric(0.8, 1.0), 0.0);
        assert!((refract(from, Vec3::Y, 1.0).expect("no total reflection") + from).length() < 1e-6);
    }

    #[test]
    fn brewster_angle_loses_the_parallel_half() {
        let brewster = 1.5_f32.atan();
        let r = fresnel_dielectric(brewster.cos(), 1.5);
        let perpendicular = (2.0 * brewster).cos().powi(2); // sin²(θi - θt) with θi + θt = 90°
        assert!((r - 0.5 * perpendicular).abs() < 1e-5);
    }

    #[test]
    fn beyond_the_critical_angle_all_is_reflected() {
        let from = Vec3::new(0.8, 0.6, 0.0);
        assert_eq!(refract(from, Vec3::Y, 1.0 / 1.5), None);
        assert_eq!(fresnel_dielectric(0.6, 1.0 / 1.5), 1.0);
    }
}
