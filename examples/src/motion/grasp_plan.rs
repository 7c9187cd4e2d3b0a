//! Planning a grasp, as a person does who sees the object.
//!
//! The script must move real fingers to a real surface, for any object. The plan
//! tries places of the wrist over the object and closes the fingers of the same
//! hand model the loop uses, finger by finger, until each meets the surface; it
//! keeps the place where all five meet it with their last segment, with the thumb
//! opposite the others.

use glam::{DQuat, DVec3};
use glove_io::{
    Pose,
    hand::{FingerPose, HandModel},
};

use super::closure::{Closure, Style};
use crate::{
    geometry::Rigid,
    touch::{FingerShapes, Surface, Touch},
};

/// A way to take hold of an object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GraspPlan {
    /// Wrist in the object's frame.
    pub(super) wrist: Rigid,
    /// How good the grasp is; only to be compared.
    pub(super) score: f64,
    /// How the hand closes.
    style: Style,
    /// Closure of each finger when it meets the surface.
    touch: [f64; 5],
    /// Closure per metre that the fingertip travels there.
    per_metre: [f64; 5],
    /// Where each finger meets the surface, object frame.
    points: [DVec3; 5],
}

/// Fingertip travel from touch to open, metres.
pub(super) const OPEN_M: f64 = 0.03;
/// Height above the grasp from which the hand comes down, metres.
pub(super) const APPROACH_M: f64 = 0.13;

/// Closures are tried in steps of this.
const CLOSURE_STEP: f64 = 0.04;
/// Thumb rolls that are tried, degrees.
const THUMB_ROLLS_DEG: [f64; 4] = [35.0, 50.0, 65.0, 80.0];
/// Curls of the fingers that are tried, degrees.
const CURLS_DEG: [f64; 2] = [80.0, 35.0];

impl GraspPlan {
    /// Hand with every fingertip `depth_m` beyond (or, negative, before) the
    /// surface, measured along its way.
    pub(super) fn closure(&self, depths_m: [f64; 5]) -> Closure {
        Closure {
            fingers: std::array::from_fn(|f| {
                (self.touch[f] + depths_m[f] * self.per_metre[f]).clamp(0.0, 1.0)
            }),
            style: self.style,
        }
    }

    /// The least distance between a place where this grasp presses and one where the
    /// other does, metres.
    pub(super) fn distance_m(&self, other: &Self) -> f64 {
        self.points
            .iter()
            .flat_map(|a| other.points.iter().map(|b| a.distance(*b)))
            .fold(f64::INFINITY, f64::min)
    }

    /// The best grasp with the hand turned by `yaw_rad` about the vertical, palm
    /// down; `None` if no place lets all five fingers meet the surface.
    pub(super) fn find(hand: &HandModel, surface: Surface<'_>, yaw_rad: f64) -> Option<Self> {
        let heights = || surface.positions.iter().map(|p| p[1]);
        let top = heights().fold(f64::NEG_INFINITY, f64::max);
        let bottom = heights().fold(f64::INFINITY, f64::min);
        let mut best: Option<Self> = None;
        for tilt_deg in [-20.0_f64, 0.0, 20.0] {
            let rotation =
                DQuat::from_rotation_y(yaw_rad) * DQuat::from_rotation_x(tilt_deg.to_radians());
            for below in [0.014, 0.022, 0.032, 0.042, 0.052, 0.062] {
                for forward in [0.055, 0.065, 0.075, 0.085, 0.095, 0.105] {
                    for aside in [-0.012, 0.0, 0.012] {
                        // The top of the object in the palm's frame.
                        let palm = rotation * DVec3::new(aside, -below, -forward);
                        let wrist = Rigid {
                            rotation,
                            translation: DVec3::new(0.0, top, 0.0) - palm,
                        };
                        for curl_deg in CURLS_DEG {
                            let curl_rad = curl_deg.to_radians();
                            if let Some(plan) =
                                Self::at(hand, surface, wrist, curl_rad, (bottom, top))
                                && best.is_none_or(|best| plan.score > best.score)
                            {
                                best = Some(plan);
                            }
                        }
                    }
                }
            }
        }
        best
    }

    fn at(
        hand: &HandModel,
        surface: Surface<'_>,
        wrist: Rigid,
        curl_rad: f64,
        height: (f64, f64),
    ) -> Option<Self> {
        let fingers: Vec<Meeting> = (1..5)
            .map(|f| {
                let style = Style {
                    thumb_roll_rad: 0.0,
                    curl_rad,
                };
                Meeting::find(hand, surface, wrist, f, style)
            })
            .collect::<Option<_>>()?;
        let thumb_side: DVec3 = fingers.iter().map(|m| m.normal).sum();
        let opposite = -thumb_side.try_normalize()?;
        let (style, thumb) = THUMB_ROLLS_DEG
            .iter()
            .filter_map(|roll| {
                let style = Style {
                    thumb_roll_rad: roll.to_radians(),
                    curl_rad,
                };
                Some((style, Meeting::find(hand, surface, wrist, 0, style)?))
            })
            .max_by(|(_, a), (_, b)| a.normal.dot(opposite).total_cmp(&b.normal.dot(opposite)))?;
        let opposition = thumb.normal.dot(opposite);
        let all = [&[thumb][..], &fingers].concat();
        let press = all.iter().map(|m| m.press).fold(f64::INFINITY, f64::min);
        let gap = all.iter().map(|m| m.gap_m).fold(0.0, f64::max);
        // Fingertips half way up the object, as far as the palm leaves room.
        let (low, high) = height;
        let middle = (low + high) / 2.0;
        let off_m = all.iter().map(|m| (m.point.y - middle).abs()).sum::<f64>() / 5.0;
        let score = 1.5 * opposition + 2.0 * press - 60.0 * gap - 15.0 * off_m;
        let plan = Self {
            wrist,
            score,
            style,
            touch: std::array::from_fn(|f| all[f].closure),
            per_metre: std::array::from_fn(|f| all[f].per_metre),
            points: std::array::from_fn(|f| all[f].point),
        };
        plan.way_is_free(hand, surface).then_some(plan)
    }

    /// Whether the open hand can come down to its place.
    fn way_is_free(&self, hand: &HandModel, surface: Surface<'_>) -> bool {
        let angles = self.closure([-OPEN_M; 5]).angles();
        (0..=16).all(|step| {
            let height = APPROACH_M * f64::from(step) / 16.0;
            let mut wrist = self.wrist;
            wrist.translation.y += height;
            hand.pose(&wrist.into(), &angles)
                .fingers
                .iter()
                .all(|finger| !FingerShapes::new(finger).hit(surface))
        })
    }
}

/// A finger at the surface.
#[derive(Clone, Copy)]
struct Meeting {
    closure: f64,
    per_metre: f64,
    normal: DVec3,
    /// Cosine between the way of the fingertip and the inward normal.
    press: f64,
    /// Distance between fingertip and surface; positive where the side of the last
    /// segment meets it first.
    gap_m: f64,
    /// Where on the surface.
    point: DVec3,
}

impl Meeting {
    fn find(
        hand: &HandModel,
        surface: Surface<'_>,
        wrist: Rigid,
        finger: usize,
        style: Style,
    ) -> Option<Self> {
        let wrist: Pose = wrist.into();
        let at = |s: f64| -> FingerPose {
            let closure = Closure {
                fingers: [s; 5],
                style,
            };
            hand.pose(&wrist, &closure.angles()).fingers[finger]
        };
        let hits = |s: f64| FingerShapes::new(&at(s)).hit(surface);
        let mut free = 0.0;
        if hits(free) {
            return None;
        }
        while !hits(free + CLOSURE_STEP) {
            free += CLOSURE_STEP;
            if free > 0.9 {
                return None;
            }
        }
        let mut blocked = free + CLOSURE_STEP;
        while blocked - free > 1e-5 {
            let middle = 0.5 * (free + blocked);
            if hits(middle) {
                blocked = middle;
            } else {
                free = middle;
            }
        }
        let met = at(blocked);
        if FingerShapes::new(&met).palmward_hit(surface) {
            return None;
        }
        let contact = Touch::of(&met, surface).fingertip()?;
        let tip = |s: f64| DVec3::from_array(at(s).tip_center_m());
        let travel = tip(blocked + 0.01) - tip(blocked);
        let normal = DVec3::from_array(contact.normal);
        let press = -normal.dot(travel.try_normalize()?);
        Some(Self {
            closure: blocked,
            per_metre: 0.01 / travel.length(),
            normal,
            press,
            gap_m: -contact.depth.min(0.0),
            point: DVec3::from_array(contact.point),
        })
        .filter(|meeting| meeting.press > 0.2)
    }
}
