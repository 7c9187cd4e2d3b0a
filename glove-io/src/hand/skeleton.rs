//! Bone lengths, joint positions and radii of an average adult right hand.

/// One finger other than the thumb, straight, in the wrist frame.
pub(super) struct FingerBones {
    /// Base of the metacarpal (CMC joint), metres.
    pub(super) base_m: [f64; 3],
    /// Direction of the metacarpal in the palm's plane: angle from −z towards +x.
    pub(super) metacarpal_fan_rad: f64,
    /// Direction of the straight finger, same measure.
    pub(super) finger_fan_rad: f64,
    /// Length of the metacarpal, metres.
    pub(super) metacarpal_m: f64,
    /// Lengths of proximal, intermediate and distal phalanx, metres.
    pub(super) phalanges_m: [f64; 3],
    /// Thickness of soft tissue beyond the distal bone, metres.
    pub(super) tip_tissue_m: f64,
    /// Radii of the three segments, metres.
    pub(super) radii_m: [f64; 3],
}

/// The thumb, straight along the index finger's side, in the wrist frame.
pub(super) struct ThumbBones {
    /// CMC joint, metres.
    pub(super) base_m: [f64; 3],
    /// Angle between the thumb and −z at zero abduction.
    pub(super) rest_abduction_rad: f64,
    /// Lengths of metacarpal, proximal and distal phalanx, metres.
    pub(super) bones_m: [f64; 3],
    /// Thickness of soft tissue beyond the distal bone, metres.
    pub(super) tip_tissue_m: f64,
    /// Radii of the three segments, metres.
    pub(super) radii_m: [f64; 3],
}

/// Lengths from \[BK10\] (see the [references](super#references)). The bases of the
/// fingers are not in that source: they are a fan whose wrist-to-tip distances, all
/// angles zero, come within 5 mm of the male means of \[Gre91\]. Radii are our
/// choice, a little below half of Greiner's joint breadths because a finger is
/// flatter than it is wide.
pub(super) const FINGERS: [FingerBones; 4] = [
    FingerBones {
        base_m: [-0.016, 0.0, -0.035],
        metacarpal_fan_rad: -0.14,
        finger_fan_rad: -0.07,
        metacarpal_m: 0.068_12,
        phalanges_m: [0.039_78, 0.022_38, 0.015_82],
        tip_tissue_m: 0.003_84,
        radii_m: [0.0095, 0.0085, 0.0075],
    },
    FingerBones {
        base_m: [-0.003, 0.0, -0.037],
        metacarpal_fan_rad: -0.02,
        finger_fan_rad: 0.0,
        metacarpal_m: 0.064_60,
        phalanges_m: [0.044_63, 0.026_33, 0.017_40],
        tip_tissue_m: 0.003_95,
        radii_m: [0.0098, 0.0086, 0.0077],
    },
    FingerBones {
        base_m: [0.009, 0.0, -0.037],
        metacarpal_fan_rad: 0.12,
        finger_fan_rad: 0.05,
        metacarpal_m: 0.058_00,
        phalanges_m: [0.041_37, 0.025_65, 0.017_30],
        tip_tissue_m: 0.003_95,
        radii_m: [0.0092, 0.0080, 0.0072],
    },
    FingerBones {
        base_m: [0.019, 0.0, -0.033],
        metacarpal_fan_rad: 0.26,
        finger_fan_rad: 0.13,
        metacarpal_m: 0.053_69,
        phalanges_m: [0.032_74, 0.018_11, 0.015_96],
        tip_tissue_m: 0.003_73,
        radii_m: [0.0082, 0.0070, 0.0063],
    },
];

/// Sources and placement as for [`FINGERS`].
pub(super) const THUMB: ThumbBones = ThumbBones {
    base_m: [-0.024, -0.006, -0.023],
    rest_abduction_rad: 0.15,
    bones_m: [0.046_22, 0.031_57, 0.021_67],
    tip_tissue_m: 0.005_67,
    radii_m: [0.0115, 0.0105, 0.0095],
};
