//! Certificates as data, for serde.
//!
//! Fields that a claim does not need must be absent, so that nothing is said that is not
//! checked. Lists are read as they come and have to have the right length in the end.

use serde::de::{Deserializer, Error};
use serde::ser::Serializer;
use serde::{Deserialize, Serialize};

use super::place::Spot;
use super::{Certificate, Global, Proof};

/// All that may stand in a certificate.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Data {
    claim: Word,
    degree: Vec<usize>,
    cells: Vec<usize>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    min_det: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    cuts: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    theorem: Option<TheoremData>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    evidence: Option<EvidenceData>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Word {
    Injective,
    LocallyInjective,
    NotInjective,
    Degenerate,
    Reversed,
}

#[derive(Serialize, Deserialize)]
#[serde(tag = "name", rename_all = "snake_case", deny_unknown_fields)]
enum TheoremData {
    IdentityBorder {},
    PMatrix {
        after: Vec<Vec<f64>>,
        cuts: Vec<String>,
    },
    Monotone {
        after: Vec<Vec<f64>>,
        cuts: String,
    },
    DominantRows {
        after: Vec<Vec<f64>>,
        cuts: String,
    },
    CommonCones {
        axes: Vec<Vec<f64>>,
        sines: Vec<f64>,
        cuts: String,
    },
}

#[derive(Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
enum EvidenceData {
    BothSigns {
        positive: PlaceData,
        negative: PlaceData,
    },
    Overlap {
        point: PlaceData,
        other: PlaceData,
        radius: f64,
    },
    Zero {
        zero: PlaceData,
        reversed: bool,
    },
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlaceData {
    cell: Vec<usize>,
    t: Vec<f64>,
}

impl<const D: usize> From<&Spot<D>> for PlaceData {
    fn from(spot: &Spot<D>) -> Self {
        Self {
            cell: spot.cell.to_vec(),
            t: spot.t.to_vec(),
        }
    }
}

fn rows<const D: usize>(matrix: &[[f64; D]; D]) -> Vec<Vec<f64>> {
    matrix.iter().map(|row| row.to_vec()).collect()
}

impl<const D: usize> From<&Global<D>> for TheoremData {
    fn from(global: &Global<D>) -> Self {
        match global {
            Global::IdentityBorder => Self::IdentityBorder {},
            Global::PMatrix { after, cuts } => Self::PMatrix {
                after: rows(after),
                cuts: cuts.clone(),
            },
            Global::Monotone { after, cuts } => Self::Monotone {
                after: rows(after),
                cuts: cuts.clone(),
            },
            Global::DominantRows { after, cuts } => Self::DominantRows {
                after: rows(after),
                cuts: cuts.clone(),
            },
            Global::CommonCones { axes, sines, cuts } => Self::CommonCones {
                axes: rows(axes),
                sines: sines.to_vec(),
                cuts: cuts.clone(),
            },
        }
    }
}

impl<const D: usize> Serialize for Certificate<D> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut data = Data {
            claim: Word::NotInjective,
            degree: self.degree.to_vec(),
            cells: self.cells.to_vec(),
            min_det: None,
            cuts: None,
            theorem: None,
            evidence: None,
        };
        match &self.proof {
            Proof::Regular {
                cuts,
                min_det,
                theorem,
            } => {
                data.claim = match theorem {
                    Some(_) => Word::Injective,
                    None => Word::LocallyInjective,
                };
                data.min_det = Some(*min_det);
                data.cuts = Some(cuts.clone());
                data.theorem = theorem.as_ref().map(TheoremData::from);
            }
            Proof::Reversed { cuts } => {
                data.claim = Word::Reversed;
                data.cuts = Some(cuts.clone());
            }
            Proof::Degenerate {
                cuts,
                zero,
                reversed,
            } => {
                data.claim = Word::Degenerate;
                data.cuts = Some(cuts.clone());
                data.evidence = Some(EvidenceData::Zero {
                    zero: zero.into(),
                    reversed: *reversed,
                });
            }
            Proof::BothSigns { positive, negative } => {
                data.evidence = Some(EvidenceData::BothSigns {
                    positive: positive.into(),
                    negative: negative.into(),
                });
            }
            Proof::Overlap {
                point,
                other,
                radius,
            } => {
                data.evidence = Some(EvidenceData::Overlap {
                    point: point.into(),
                    other: other.into(),
                    radius: *radius,
                });
            }
        }
        data.serialize(serializer)
    }
}

impl<'de, const D: usize> Deserialize<'de> for Certificate<D> {
    fn deserialize<R: Deserializer<'de>>(deserializer: R) -> Result<Self, R::Error> {
        let data = Data::deserialize(deserializer)?;
        let proof = match (
            data.claim,
            data.min_det,
            data.cuts,
            data.theorem,
            data.evidence,
        ) {
            (Word::Injective, Some(min_det), Some(cuts), Some(theorem), None) => Proof::Regular {
                cuts,
                min_det,
                theorem: Some(global(theorem)?),
            },
            (Word::LocallyInjective, Some(min_det), Some(cuts), None, None) => Proof::Regular {
                cuts,
                min_det,
                theorem: None,
            },
            (Word::Reversed, None, Some(cuts), None, None) => Proof::Reversed { cuts },
            (
                Word::Degenerate,
                None,
                Some(cuts),
                None,
                Some(EvidenceData::Zero { zero, reversed }),
            ) => Proof::Degenerate {
                cuts,
                zero: spot(zero)?,
                reversed,
            },
            (
                Word::NotInjective,
                None,
                None,
                None,
                Some(EvidenceData::BothSigns { positive, negative }),
            ) => Proof::BothSigns {
                positive: spot(positive)?,
                negative: spot(negative)?,
            },
            (
                Word::NotInjective,
                None,
                None,
                None,
                Some(EvidenceData::Overlap {
                    point,
                    other,
                    radius,
                }),
            ) => Proof::Overlap {
                point: spot(point)?,
                other: spot(other)?,
                radius,
            },
            _ => {
                return Err(R::Error::custom(
                    "the fields of a certificate do not belong to its `claim`",
                ));
            }
        };
        Ok(Self {
            degree: array(data.degree, "degree")?,
            cells: array(data.cells, "cells")?,
            proof,
        })
    }
}

fn global<const D: usize, E: Error>(data: TheoremData) -> Result<Global<D>, E> {
    Ok(match data {
        TheoremData::IdentityBorder {} => Global::IdentityBorder,
        TheoremData::PMatrix { after, cuts } => Global::PMatrix {
            after: matrix(after, "after")?,
            cuts,
        },
        TheoremData::Monotone { after, cuts } => Global::Monotone {
            after: matrix(after, "after")?,
            cuts,
        },
        TheoremData::DominantRows { after, cuts } => Global::DominantRows {
            after: matrix(after, "after")?,
            cuts,
        },
        TheoremData::CommonCones { axes, sines, cuts } => Global::CommonCones {
            axes: matrix(axes, "axes")?,
            sines: array(sines, "sines")?,
            cuts,
        },
    })
}

fn spot<const D: usize, E: Error>(data: PlaceData) -> Result<Spot<D>, E> {
    Ok(Spot {
        cell: array(data.cell, "cell")?,
        t: array(data.t, "t")?,
    })
}

fn matrix<const D: usize, E: Error>(
    rows: Vec<Vec<f64>>,
    name: &'static str,
) -> Result<[[f64; D]; D], E> {
    let rows: Vec<[f64; D]> = rows
        .into_iter()
        .map(|row| array(row, name))
        .collect::<Result<_, E>>()?;
    array(rows, name)
}

fn array<T, const D: usize, E: Error>(list: Vec<T>, name: &'static str) -> Result<[T; D], E> {
    let found = list.len();
    list.try_into()
        .map_err(|_| E::custom(format_args!("`{name}` must be a list of {D}, not {found}")))
}
