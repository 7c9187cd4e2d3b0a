//! The grasp: a pure function of what the fingers do.
//!
//! \[Ma98\] (section 4.5) attaches the rigid object to the palm when index, middle and
//! ring finger collide with it in the same frame, looks up thumb and little finger
//! afterwards, and starts the elastic analysis when five fingertips hold it. It
//! gives no rule for letting go. Ours: a finger lets go when it has opened by more
//! than a gap, and the object is released when fewer than three fingers hold it.

use glove_io::hand::Finger;

/// What the object is to the hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Phase {
    /// It stands by itself, rigid and impenetrable.
    #[default]
    Free,
    /// It moves with the palm, still rigid and impenetrable.
    Attached,
    /// It moves with the palm and gives way to the fingertips.
    Deforming,
}

/// What changed in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum GraspEvent {
    /// The object was attached to the palm.
    Attached,
    /// A finger took hold.
    TookHold,
    /// A finger let go.
    LetGo,
    /// The object became elastic.
    BecameElastic,
    /// The object was released.
    Released,
    /// The deformed shape became the rest shape, and the object returned to its place.
    KeptShape,
}

/// The rules.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GraspRules {
    /// Fingertips that must hold the object before it gives way: five in the
    /// thesis; at least three are needed to determine the deformation.
    pub fingers_to_deform: usize,
    /// How far a finger opens before it lets go, metres.
    pub release_gap_m: f64,
}

impl Default for GraspRules {
    fn default() -> Self {
        Self {
            fingers_to_deform: 5,
            release_gap_m: 3e-3,
        }
    }
}

/// Fewest fingers that hold an object.
pub const FEWEST_HOLDING: usize = 3;

/// How a finger holds the object, in rising order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Grip {
    /// Not at all.
    #[default]
    None,
    /// With a segment that cannot deform it.
    Finger,
    /// With the fingertip.
    Fingertip,
}

/// The state of a grasp.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Grasp {
    phase: Phase,
    grips: [Grip; 5],
    /// Fingers that let go and have not been apart from the surface since.
    spent: [bool; 5],
}

impl Grasp {
    /// The phase after the last update.
    #[must_use]
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// How each finger holds the object; not at all while it is free.
    #[must_use]
    pub fn grips(&self) -> [Grip; 5] {
        self.grips
    }

    /// Advances by one frame and appends what happened to `events`.
    ///
    /// `touching`: what each finger touches the surface with. `opening_m`: for fingers
    /// that hold the object, how far they have opened; ignored for the others.
    pub fn update(
        &mut self,
        rules: &GraspRules,
        touching: [Grip; 5],
        opening_m: [f64; 5],
        events: &mut Vec<GraspEvent>,
    ) {
        // A finger that let go must leave the surface before it takes hold again;
        // the surface that springs back would otherwise be caught at once.
        let mut touching = touching;
        for (spent, touch) in self.spent.iter_mut().zip(&mut touching) {
            *spent &= *touch != Grip::None;
            if *spent {
                *touch = Grip::None;
            }
        }
        if self.phase == Phase::Free {
            let together = [Finger::Index, Finger::Middle, Finger::Ring];
            if together.iter().any(|f| touching[f.index()] == Grip::None) {
                return;
            }
            self.phase = Phase::Attached;
            events.push(GraspEvent::Attached);
        }
        for finger in 0..5 {
            let grip = &mut self.grips[finger];
            if *grip != Grip::None && opening_m[finger] > rules.release_gap_m {
                *grip = Grip::None;
                self.spent[finger] = true;
                events.push(GraspEvent::LetGo);
            } else if touching[finger] > *grip {
                if *grip == Grip::None {
                    events.push(GraspEvent::TookHold);
                }
                *grip = touching[finger];
            }
        }
        let with = |least: Grip| self.grips.iter().filter(|&&grip| grip >= least).count();
        if with(Grip::Finger) < FEWEST_HOLDING {
            self.release();
            events.push(GraspEvent::Released);
        } else if self.phase == Phase::Attached && with(Grip::Fingertip) >= rules.fingers_to_deform
        {
            self.phase = Phase::Deforming;
            events.push(GraspEvent::BecameElastic);
        }
    }

    /// Lets go of everything at once.
    pub fn release(&mut self) {
        self.phase = Phase::Free;
        self.grips = [Grip::None; 5];
        self.spent = [true; 5];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULES: GraspRules = GraspRules {
        fingers_to_deform: 5,
        release_gap_m: 4e-3,
    };

    /// `touching`: 0 nothing, 1 a segment, 2 the fingertip.
    fn step(grasp: &mut Grasp, touching: [u8; 5], opening_mm: [f64; 5]) -> Vec<GraspEvent> {
        let mut events = Vec::new();
        let touching = touching.map(|t| [Grip::None, Grip::Finger, Grip::Fingertip][t as usize]);
        grasp.update(&RULES, touching, opening_mm.map(|o| o * 1e-3), &mut events);
        events
    }

    #[test]
    fn index_middle_and_ring_attach_together_or_not_at_all() {
        let mut grasp = Grasp::default();
        for touching in [[2, 2, 2, 0, 2], [0, 2, 0, 2, 2], [2, 0, 1, 2, 0]] {
            assert_eq!(step(&mut grasp, touching, [0.0; 5]), []);
            assert_eq!(grasp.phase(), Phase::Free);
        }
        let events = step(&mut grasp, [0, 2, 1, 2, 0], [0.0; 5]);
        assert_eq!(events[0], GraspEvent::Attached);
        use Grip::{Finger, Fingertip, None};
        assert_eq!(grasp.grips(), [None, Fingertip, Finger, Fingertip, None]);
    }

    #[test]
    fn five_fingertips_make_it_elastic_and_opening_releases_it() {
        let mut grasp = Grasp::default();
        step(&mut grasp, [0, 2, 2, 1, 0], [0.0; 5]);
        step(&mut grasp, [2, 2, 2, 1, 2], [0.0; 5]);
        assert_eq!(grasp.phase(), Phase::Attached);
        // The ring finger's segment becomes its tip: all five.
        assert_eq!(
            step(&mut grasp, [0, 0, 0, 2, 0], [0.0; 5]),
            [GraspEvent::BecameElastic]
        );
        // Within the gap everything stays; two may let go; the third releases.
        assert_eq!(step(&mut grasp, [0; 5], [3.9; 5]), []);
        let two = step(&mut grasp, [0; 5], [4.1, 0.0, 0.0, 0.0, 4.1]);
        assert_eq!(two, [GraspEvent::LetGo; 2]);
        assert_eq!(grasp.phase(), Phase::Deforming);
        let third = step(&mut grasp, [0; 5], [0.0, 5.0, 0.0, 0.0, 0.0]);
        assert_eq!(third, [GraspEvent::LetGo, GraspEvent::Released]);
        assert_eq!(
            (grasp.phase(), grasp.grips()),
            (Phase::Free, [Grip::None; 5])
        );
    }

    /// What was let go is not caught again before the fingers have left it.
    #[test]
    fn letting_go_is_final_until_the_finger_has_been_apart() {
        let mut grasp = Grasp::default();
        step(&mut grasp, [2; 5], [0.0; 5]);
        assert!(step(&mut grasp, [2; 5], [9.0; 5]).contains(&GraspEvent::Released));
        assert_eq!(step(&mut grasp, [2; 5], [0.0; 5]), []);
        assert_eq!(step(&mut grasp, [2, 0, 0, 0, 2], [0.0; 5]), []);
        assert_eq!(step(&mut grasp, [2; 5], [0.0; 5])[0], GraspEvent::Attached);
        // Thumb and little finger have not been apart yet.
        assert_eq!(grasp.grips()[0], Grip::None);
        assert_eq!(grasp.grips()[4], Grip::None);
    }
}
