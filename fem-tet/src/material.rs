//! Isotropic linear elasticity.

use crate::FemError;

/// An isotropic linear elastic material.
///
/// # Example
///
/// ```
/// let foam = fem_tet::Material::new(20e3, 0.3)?;
/// assert_eq!(foam.youngs_modulus_pa(), 20e3);
/// assert!(fem_tet::Material::new(20e3, 0.5).is_err()); // incompressible
/// # Ok::<(), fem_tet::FemError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    youngs_modulus_pa: f64,
    poissons_ratio: f64,
}

impl Material {
    /// A material from Young's modulus `E` in pascal and Poisson's ratio `ν`.
    ///
    /// Linear tetrahedra grow too stiff as `ν` nears one half ("locking"); keep
    /// `ν` at or below 0.45 with them.
    ///
    /// # Errors
    ///
    /// [`FemError::Material`] unless `E` is positive and finite and
    /// `−1 < ν < 0.5`.
    pub fn new(youngs_modulus_pa: f64, poissons_ratio: f64) -> Result<Self, FemError> {
        if !(youngs_modulus_pa > 0.0 && youngs_modulus_pa.is_finite()) {
            return Err(FemError::Material {
                name: "Young's modulus",
                value: youngs_modulus_pa,
                requirement: "a positive, finite number of pascal",
            });
        }
        if !(poissons_ratio > -1.0 && poissons_ratio < 0.5) {
            return Err(FemError::Material {
                name: "Poisson's ratio",
                value: poissons_ratio,
                requirement: "above -1 and below 0.5",
            });
        }
        Ok(Self {
            youngs_modulus_pa,
            poissons_ratio,
        })
    }

    /// Young's modulus, pascal.
    #[must_use]
    pub fn youngs_modulus_pa(&self) -> f64 {
        self.youngs_modulus_pa
    }

    /// Poisson's ratio.
    #[must_use]
    pub fn poissons_ratio(&self) -> f64 {
        self.poissons_ratio
    }

    /// Lamé's constants `(λ, μ)`, pascal.
    pub(crate) fn lame(&self) -> (f64, f64) {
        let (e, nu) = (self.youngs_modulus_pa, self.poissons_ratio);
        (
            e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)),
            e / (2.0 * (1.0 + nu)),
        )
    }
}
