//! The only file that names rapier's mathematics: nalgebra outside, rapier's own vectors inside.

use nalgebra::{Matrix3, Rotation3, SymmetricEigen, UnitQuaternion, Vector3};
use rapier3d_f64::dynamics::MassProperties;
use rapier3d_f64::math::{Pose, Vector};

pub(super) fn to_vector(v: Vector3<f64>) -> Vector {
    v.into()
}

pub(super) fn from_vector(v: Vector) -> Vector3<f64> {
    v.into()
}

pub(super) fn to_pose(position: Vector3<f64>, rotation: UnitQuaternion<f64>) -> Pose {
    Pose::from_parts(position.into(), rotation.into())
}

pub(super) fn from_pose(pose: &Pose) -> (Vector3<f64>, UnitQuaternion<f64>) {
    (pose.translation.into(), pose.rotation.into())
}

/// Mass at the origin with its inertia as principal moments in their own frame.
pub(super) fn mass_properties(mass_kg: f64, inertia_kg_m2: &Matrix3<f64>) -> MassProperties {
    let SymmetricEigen { eigenvalues, mut eigenvectors } =
        SymmetricEigen::new((inertia_kg_m2 + inertia_kg_m2.transpose()) * 0.5);
    // The eigenvectors may come left-handed; a principal axis has no sign.
    if eigenvectors.determinant() < 0.0 {
        eigenvectors.column_mut(2).neg_mut();
    }
    let body_from_principal =
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(eigenvectors));
    MassProperties::with_principal_inertia_frame(
        Vector::ZERO,
        mass_kg,
        eigenvalues.into(),
        body_from_principal.into(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_inertia_matrix_survives_its_principal_axes() {
        let inertia =
            Matrix3::new(3.2e-3, 4.0e-4, -2.0e-4, 4.0e-4, 4.7e-3, 3.0e-4, -2.0e-4, 3.0e-4, 7.1e-3);
        let p = mass_properties(0.548, &inertia);
        assert_eq!(p.mass(), 0.548);
        let axes = UnitQuaternion::from(p.principal_inertia_local_frame).to_rotation_matrix();
        let moments = Matrix3::from_diagonal(&from_vector(p.principal_inertia()));
        assert!((axes.matrix() * moments * axes.matrix().transpose() - inertia).amax() < 1e-15);
    }
}
