//! The `.bin` form of an artefact: a header of fixed size, then the body in bincode. The only module that names it.
//!
//! ```text
//! offset  bytes  what
//!      0      8  magic "REGRASP\0"
//!      8      4  format version, u32 little-endian
//!     12      4  kind, u32
//!     16      8  length of the body in bytes, u64
//!     24     32  digest of the scene (zero: no scene)
//!     56     32  BLAKE3 of the body
//!     88      …  body
//! ```

use crate::artefact::{
    CertificatesFile, CutsFile, LeafCut, PathCertificateFile, PlanFile, ProofFile, Region, RegionCertificate,
    RegionsFile, Segment, TrajectoryFile,
};
use crate::{Digest, hexadecimal};
use bincode::Options;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::path::{Path, PathBuf};

/// Version of the `.bin` format.
pub const FORMAT_VERSION: u32 = 6;

/// First bytes of every `.bin`.
pub const MAGIC: [u8; 8] = *b"REGRASP\0";

/// Bytes before the body.
pub const HEADER_BYTES: usize = 88;

/// Longest body that is read or written, bytes: a damaged length must not exhaust the memory.
pub const MAX_BODY_BYTES: u64 = 1 << 32;

/// What a `.bin` holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Kind {
    /// [`RegionsFile`].
    Regions = 1,
    /// [`CertificatesFile`].
    Certificates = 2,
    /// [`PlanFile`].
    Plan = 3,
    /// [`TrajectoryFile`].
    Trajectory = 4,
    /// [`CutsFile`].
    Cuts = 5,
    /// [`Region`], a part.
    Region = 6,
    /// [`CertifiedPart`], a part.
    CertifiedPart = 7,
    /// [`Segment`], a part.
    Segment = 8,
    /// [`LeafCut`], a part.
    Cut = 9,
    /// [`PathCertificateFile`].
    PathCertificate = 10,
    /// [`ProofFile`].
    Proof = 11,
}

impl Kind {
    const ALL: [Kind; 11] = [
        Kind::Regions,
        Kind::Certificates,
        Kind::Plan,
        Kind::Trajectory,
        Kind::Cuts,
        Kind::Region,
        Kind::CertifiedPart,
        Kind::Segment,
        Kind::Cut,
        Kind::PathCertificate,
        Kind::Proof,
    ];

    /// The word for people.
    pub fn word(self) -> &'static str {
        match self {
            Kind::Regions => "regions",
            Kind::Certificates => "certificates",
            Kind::Plan => "plan",
            Kind::Trajectory => "trajectory",
            Kind::Cuts => "cuts",
            Kind::Region => "one region",
            Kind::CertifiedPart => "one candidate's certified regions",
            Kind::Segment => "one segment",
            Kind::Cut => "one cut",
            Kind::PathCertificate => "the certificate of a path",
            Kind::Proof => "the proof of a plan",
        }
    }

    /// The kind of that number.
    pub fn from_number(number: u32) -> Option<Kind> {
        Kind::ALL.into_iter().find(|kind| *kind as u32 == number)
    }
}

/// Data of which a `.bin` can be made.
pub trait Written: Serialize {
    /// Which.
    const KIND: Kind;
}

/// Data that a `.bin` can hold.
pub trait Artefact: Written + DeserializeOwned {}

impl<A: Written + DeserializeOwned> Artefact for A {}

macro_rules! artefacts {
    ($($data:ty => $kind:ident),* $(,)?) => { $(impl Written for $data { const KIND: Kind = Kind::$kind; })* };
}
artefacts!(
    RegionsFile => Regions, CertificatesFile => Certificates, PlanFile => Plan, TrajectoryFile => Trajectory,
    CutsFile => Cuts, Region => Region, CertifiedPart => CertifiedPart, Segment => Segment, LeafCut => Cut,
    PathCertificateFile => PathCertificate, ProofFile => Proof,
);

/// What certification made of one candidate: `certify/parts/<candidate id>.bin`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CertifiedPart {
    /// The candidate.
    pub candidate_id: u64,
    /// Certified regions, sorted by id; empty if nothing of the candidate could be certified.
    pub regions: Vec<Region>,
    /// Their certificates, in the same order; empty if nothing was certified (`--certify none`).
    pub certificates: Vec<RegionCertificate>,
    /// Why less came out than went in; empty if nothing is to be said.
    pub reason: String,
}

/// The header of a `.bin`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// What the body is.
    pub kind: Kind,
    /// Bytes of the body.
    pub body_bytes: u64,
    /// Digest of the scene.
    pub scene_digest: Digest,
    /// BLAKE3 of the body.
    pub body_digest: Digest,
}

/// A file that is not the artefact it should be.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // The messages say what the fields are.
pub enum ContainerError {
    #[error(
        "{file}: not a regrasp artefact (its first bytes are not `REGRASP`); give the file that a stage wrote"
    )]
    Magic { file: PathBuf },
    #[error(
        "{file}: format version {found}, this program reads {FORMAT_VERSION}; use programs of the same version"
    )]
    Version { file: PathBuf, found: u32 },
    #[error("{file}: holds {found}, expected {expected}; give the right file")]
    WrongKind { file: PathBuf, found: String, expected: &'static str },
    #[error("{file}: {missing} bytes are missing at the end; the file is cut short, run the stage again")]
    Missing { file: PathBuf, missing: u64 },
    #[error("{file}: {extra} bytes too many at the end; the file is damaged, run the stage again")]
    Trailing { file: PathBuf, extra: u64 },
    #[error(
        "{file}: made for another scene (digest {found}, this scene has {expected}); run on the scene it was made for"
    )]
    ForeignScene { file: PathBuf, found: String, expected: String },
    #[error("{file}: the body does not match its digest; the file is damaged, run the stage again")]
    Digest { file: PathBuf },
    #[error(
        "{file}: body of {bytes} bytes, at most {MAX_BODY_BYTES} are read; the file is damaged or too large"
    )]
    TooLarge { file: PathBuf, bytes: u64 },
    #[error(
        "{file}: the body cannot be read as {expected}: {message}; the file is damaged, run the stage again"
    )]
    Body { file: PathBuf, expected: &'static str, message: String },
}

fn codec() -> impl Options {
    bincode::DefaultOptions::new().with_fixint_encoding().with_little_endian().with_limit(MAX_BODY_BYTES)
}

/// The bytes of `value` as `.bin`. `file` only names it in errors.
pub fn encode<A: Written>(file: &Path, value: &A, scene_digest: &Digest) -> Result<Vec<u8>, ContainerError> {
    let refused = |error: bincode::Error| ContainerError::Body {
        file: file.to_owned(),
        expected: A::KIND.word(),
        message: error.to_string(),
    };
    let body_bytes = codec().serialized_size(value).map_err(refused)?;
    // Bodies can be large: they are made once, in their place.
    let mut bytes = Vec::with_capacity(HEADER_BYTES + body_bytes as usize);
    bytes.extend_from_slice(&MAGIC);
    bytes.extend_from_slice(&FORMAT_VERSION.to_le_bytes());
    bytes.extend_from_slice(&(A::KIND as u32).to_le_bytes());
    bytes.extend_from_slice(&body_bytes.to_le_bytes());
    bytes.extend_from_slice(scene_digest);
    bytes.resize(HEADER_BYTES, 0);
    codec().serialize_into(&mut bytes, value).map_err(refused)?;
    let digest = blake3::hash(&bytes[HEADER_BYTES..]);
    bytes[HEADER_BYTES - digest.as_bytes().len()..HEADER_BYTES].copy_from_slice(digest.as_bytes());
    Ok(bytes)
}

/// The header of the `.bin` in `bytes`, after checking that exactly its body follows, unharmed.
pub fn header(file: &Path, bytes: &[u8]) -> Result<Header, ContainerError> {
    let file = || file.to_owned();
    let n_magic = bytes.len().min(MAGIC.len());
    if bytes[..n_magic] != MAGIC[..n_magic] || bytes.is_empty() {
        return Err(ContainerError::Magic { file: file() });
    }
    if bytes.len() < 12 {
        return Err(ContainerError::Missing { file: file(), missing: (HEADER_BYTES - bytes.len()) as u64 });
    }
    let u32_at = |offset: usize| u32::from_le_bytes(array(bytes, offset));
    if u32_at(8) != FORMAT_VERSION {
        return Err(ContainerError::Version { file: file(), found: u32_at(8) });
    }
    if bytes.len() < HEADER_BYTES {
        return Err(ContainerError::Missing { file: file(), missing: (HEADER_BYTES - bytes.len()) as u64 });
    }
    let kind = Kind::from_number(u32_at(12)).ok_or_else(|| ContainerError::WrongKind {
        file: file(),
        found: format!("something of unknown kind {}", u32_at(12)),
        expected: "a known kind",
    })?;
    let body_bytes = u64::from_le_bytes(array(bytes, 16));
    if body_bytes > MAX_BODY_BYTES {
        return Err(ContainerError::TooLarge { file: file(), bytes: body_bytes });
    }
    let present = (bytes.len() - HEADER_BYTES) as u64;
    if present < body_bytes {
        return Err(ContainerError::Missing { file: file(), missing: body_bytes - present });
    }
    if present > body_bytes {
        return Err(ContainerError::Trailing { file: file(), extra: present - body_bytes });
    }
    let header = Header { kind, body_bytes, scene_digest: array(bytes, 24), body_digest: array(bytes, 56) };
    if blake3::hash(&bytes[HEADER_BYTES..]).as_bytes() != &header.body_digest {
        return Err(ContainerError::Digest { file: file() });
    }
    Ok(header)
}

/// The artefact in `bytes`. With `scene_digest`, one made for another scene is refused.
pub fn decode<A: Artefact>(
    file: &Path,
    bytes: &[u8],
    scene_digest: Option<&Digest>,
) -> Result<A, ContainerError> {
    let header = header(file, bytes)?;
    if header.kind != A::KIND {
        return Err(ContainerError::WrongKind {
            file: file.to_owned(),
            found: header.kind.word().to_owned(),
            expected: A::KIND.word(),
        });
    }
    if let Some(expected) = scene_digest.filter(|expected| **expected != header.scene_digest) {
        return Err(ContainerError::ForeignScene {
            file: file.to_owned(),
            found: hexadecimal(&header.scene_digest),
            expected: hexadecimal(expected),
        });
    }
    codec().deserialize(&bytes[HEADER_BYTES..]).map_err(|error| ContainerError::Body {
        file: file.to_owned(),
        expected: A::KIND.word(),
        message: error.to_string(),
    })
}

/// `N` bytes from `offset`; callers have checked the length.
fn array<const N: usize>(bytes: &[u8], offset: usize) -> [u8; N] {
    let mut out = [0; N];
    out.copy_from_slice(&bytes[offset..offset + N]);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::artefact::Mode;
    use proptest::prelude::*;

    const SCENE: Digest = [3; 32];

    fn cuts() -> CutsFile {
        CutsFile { cuts: vec![LeafCut { mode: Mode::Transfer, reached: vec![1, 2], exits: vec![(2, 5)] }] }
    }

    fn file() -> &'static Path {
        Path::new("run/gcs/cuts.bin")
    }

    fn bytes() -> Vec<u8> {
        encode(file(), &cuts(), &SCENE).unwrap()
    }

    /// The error of `bytes` after `change`; it names the file.
    #[track_caller]
    fn refused(change: impl FnOnce(&mut Vec<u8>)) -> ContainerError {
        let mut bytes = bytes();
        change(&mut bytes);
        let error = decode::<CutsFile>(file(), &bytes, Some(&SCENE)).unwrap_err();
        assert!(error.to_string().contains("run/gcs/cuts.bin"), "{error}");
        error
    }

    #[test]
    fn an_artefact_comes_back() {
        assert_eq!(decode::<CutsFile>(file(), &bytes(), Some(&SCENE)).unwrap(), cuts());
        assert_eq!(decode::<CutsFile>(file(), &bytes(), None).unwrap(), cuts());
        assert_eq!(header(file(), &bytes()).unwrap().kind, Kind::Cuts);
    }

    #[test]
    fn each_kind_of_damage_has_its_own_error() {
        assert!(matches!(refused(|b| b[0] = b'X'), ContainerError::Magic { .. }));
        assert!(matches!(refused(Vec::clear), ContainerError::Magic { .. }));
        assert!(matches!(refused(|b| b[8] = 9), ContainerError::Version { found: 9, .. }));
        assert!(matches!(refused(|b| b[12] = Kind::Plan as u8), ContainerError::WrongKind { .. }));
        assert!(matches!(refused(|b| b[12] = 200), ContainerError::WrongKind { .. }));
        assert!(matches!(refused(|b| b.push(0)), ContainerError::Trailing { extra: 1, .. }));
        assert!(matches!(refused(|b| b.truncate(b.len() - 1)), ContainerError::Missing { missing: 1, .. }));
        assert!(matches!(refused(|b| b.truncate(20)), ContainerError::Missing { .. }));
        assert!(matches!(refused(|b| b[24] ^= 1), ContainerError::ForeignScene { .. }));
        assert!(matches!(refused(|b| b[HEADER_BYTES + 3] ^= 1), ContainerError::Digest { .. }));
        assert!(matches!(refused(|b| b[23] = 255), ContainerError::TooLarge { .. }));
    }

    #[test]
    fn a_body_that_lies_about_its_length_is_refused_without_using_the_memory() {
        // The body's own count of cuts, with a digest that matches it.
        let error = refused(|b| {
            b[HEADER_BYTES..HEADER_BYTES + 8].copy_from_slice(&u64::MAX.to_le_bytes());
            let digest = *blake3::hash(&b[HEADER_BYTES..]).as_bytes();
            b[56..88].copy_from_slice(&digest);
        });
        assert!(matches!(error, ContainerError::Body { .. }), "{error}");
    }

    proptest! {
        /// Whatever the bytes, there is an answer, and only the bytes as they were written are accepted.
        #[test]
        fn one_changed_byte_is_noticed(position in 0_usize..10_000, change in 1_u8..=255) {
            let mut bytes = bytes();
            let position = position % bytes.len();
            bytes[position] ^= change;
            prop_assert!(decode::<CutsFile>(file(), &bytes, Some(&SCENE)).is_err());
        }

        #[test]
        fn random_bytes_are_refused(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
            prop_assert!(decode::<CutsFile>(file(), &bytes, None).is_err());
        }
    }
}
