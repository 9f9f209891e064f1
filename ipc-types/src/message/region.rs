//! A region as a message: header, then `A` by rows [m · n], `b` [m], centre [n].

use super::{MessageError, NO_ID, bytes_text, check, text_bytes};
use crate::artefact::Region;
use crate::{Digest, PROTOCOL_VERSION, validate};
use iceoryx2::prelude::ZeroCopySend;

/// Header of a region.
#[derive(Debug, Clone, Copy, Default, PartialEq, ZeroCopySend)]
#[type_name("RegionHeader")]
#[repr(C)]
pub struct RegionHeader {
    /// [`PROTOCOL_VERSION`].
    pub protocol_version: u32,
    /// A [`RegionStatus`].
    pub status: u32,
    /// Id.
    pub id: u64,
    /// Id of the candidate it came from, or [`NO_ID`].
    pub parent: u64,
    /// m; 0: the payload is empty, the region is on disk.
    pub n_faces: u64,
    /// n.
    pub dim: u64,
    /// Coordinate space: 0 is C-space.
    pub space: u32,
    /// Worker that sent it.
    pub worker: u32,
    /// Margin, metres.
    pub margin: f64,
    /// Number of the message of its sender, from 0.
    pub sequence: u64,
    /// Method, UTF-8, filled with zeros.
    pub method: [u8; 32],
    /// Digest of the scene.
    pub scene_digest: Digest,
    /// Digest of seed, task and options of the sender.
    pub options_digest: Digest,
}

/// What is known of a region.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum RegionStatus {
    /// Not certified.
    Candidate = 1,
    /// Certified.
    Certified = 2,
}

impl RegionHeader {
    /// Header and payload of a region. The payload is empty if the method's name is too long for the header.
    pub fn encode(region: &Region, scene_digest: &Digest) -> (RegionHeader, Vec<f64>) {
        let (method, fits) = text_bytes(&region.method);
        let mut payload = Vec::new();
        if fits {
            payload.extend(region.A.iter().flatten());
            payload.extend(&region.b);
            payload.extend(&region.center);
        }
        let status = if region.certified { RegionStatus::Certified } else { RegionStatus::Candidate };
        let header = RegionHeader {
            protocol_version: PROTOCOL_VERSION,
            status: status as u32,
            id: region.id,
            parent: region.parent.unwrap_or(NO_ID),
            n_faces: if fits { region.A.len() as u64 } else { 0 },
            dim: region.center.len() as u64,
            margin: region.margin,
            method,
            scene_digest: *scene_digest,
            ..RegionHeader::default()
        };
        (header, payload)
    }

    /// The region; `None` if it is to be read from disk.
    pub fn decode(&self, payload: &[f64], scene_digest: &Digest) -> Result<Option<Region>, MessageError> {
        check(self.protocol_version, &self.scene_digest, scene_digest)?;
        if self.n_faces == 0 {
            return Ok(None);
        }
        let expected = self.n_faces.checked_mul(self.dim).and_then(|entries| {
            entries
                .checked_add(self.n_faces)?
                .checked_add(self.dim)
                .filter(|total| *total == payload.len() as u64)
        });
        if expected.is_none() || self.dim == 0 {
            return Err(MessageError::Field {
                field: "length of the payload of a region",
                value: payload.len() as u64,
                expected: format!("m n + m + n with m = {}, n = {}", self.n_faces, self.dim),
            });
        }
        // Both are at most the length of the payload, so they fit.
        let (m, n) = (self.n_faces as usize, self.dim as usize);
        let certified = match self.status {
            1 => false,
            2 => true,
            other => {
                return Err(MessageError::Field {
                    field: "status of a region",
                    value: u64::from(other),
                    expected: "1 or 2".into(),
                });
            }
        };
        let region = Region {
            id: self.id,
            parent: (self.parent != NO_ID).then_some(self.parent),
            A: payload[..m * n].chunks_exact(n).map(<[f64]>::to_vec).collect(),
            b: payload[m * n..m * n + m].to_vec(),
            center: payload[m * n + m..].to_vec(),
            method: bytes_text(&self.method),
            certified,
            margin: self.margin,
        };
        validate::region(&region, n).map_err(|violation| MessageError::Region { id: self.id, violation })?;
        Ok(Some(region))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: Digest = [7; 32];

    fn interval() -> Region {
        Region {
            id: 5,
            parent: Some(2),
            A: vec![vec![1.0], vec![-1.0]],
            b: vec![1.0, 0.5],
            center: vec![0.25],
            method: "iris-zo".into(),
            certified: true,
            margin: 1e-3,
        }
    }

    #[test]
    fn a_region_comes_back_bit_for_bit() {
        let (header, payload) = RegionHeader::encode(&interval(), &SCENE);
        assert_eq!(payload, [1.0, -1.0, 1.0, 0.5, 0.25]);
        assert_eq!(header.decode(&payload, &SCENE).unwrap(), Some(interval()));
    }

    #[test]
    fn what_does_not_fit_is_read_from_disk() {
        let region = Region { method: "m".repeat(33), ..interval() };
        let (header, payload) = RegionHeader::encode(&region, &SCENE);
        assert!(payload.is_empty());
        assert_eq!(header.decode(&payload, &SCENE).unwrap(), None);
    }

    #[test]
    fn other_versions_scenes_lengths_and_numbers_are_refused() {
        let (header, mut payload) = RegionHeader::encode(&interval(), &SCENE);
        let older = RegionHeader { protocol_version: 0, ..header };
        assert_eq!(older.decode(&payload, &SCENE), Err(MessageError::Version { found: 0 }));
        assert!(matches!(header.decode(&payload, &[8; 32]), Err(MessageError::ForeignScene { .. })));
        assert!(matches!(header.decode(&payload[1..], &SCENE), Err(MessageError::Field { .. })));
        let huge = RegionHeader { n_faces: u64::MAX, dim: u64::MAX, ..header };
        assert!(matches!(huge.decode(&payload, &SCENE), Err(MessageError::Field { .. })));
        payload[0] = f64::NAN;
        let error = header.decode(&payload, &SCENE).unwrap_err();
        assert!(error.to_string().contains("A[0][0]"), "{error}");
    }
}
