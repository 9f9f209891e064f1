//! Sets of vertices as bits: intersections of neighbourhoods at a word a step.

/// A set of vertices 0..n.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct VertexSet {
    words: Vec<u64>,
}

impl VertexSet {
    /// No vertex of 0..n.
    pub(crate) fn empty(n: usize) -> Self {
        Self { words: vec![0; n.div_ceil(64)] }
    }

    /// All vertices of 0..n.
    pub(crate) fn all(n: usize) -> Self {
        let mut set = Self::empty(n);
        (0..n).for_each(|vertex| set.insert(vertex));
        set
    }

    pub(crate) fn insert(&mut self, vertex: usize) {
        self.words[vertex / 64] |= 1 << (vertex % 64);
    }

    pub(crate) fn remove(&mut self, vertex: usize) {
        self.words[vertex / 64] &= !(1 << (vertex % 64));
    }

    #[cfg(test)]
    pub(crate) fn contains(&self, vertex: usize) -> bool {
        self.words[vertex / 64] >> (vertex % 64) & 1 == 1
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.words.iter().all(|word| *word == 0)
    }

    pub(crate) fn len(&self) -> usize {
        self.words.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// The least vertex.
    pub(crate) fn first(&self) -> Option<usize> {
        let place = self.words.iter().position(|word| *word != 0)?;
        Some(64 * place + self.words[place].trailing_zeros() as usize)
    }

    /// The vertices in order.
    pub(crate) fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.words.iter().enumerate().flat_map(|(place, &word)| {
            let mut left = word;
            std::iter::from_fn(move || {
                let bit = (left != 0).then(|| left.trailing_zeros() as usize)?;
                left &= left - 1;
                Some(64 * place + bit)
            })
        })
    }

    /// Keeps what `other` has too.
    pub(crate) fn keep(&mut self, other: &Self) {
        self.words.iter_mut().zip(&other.words).for_each(|(word, other)| *word &= other);
    }

    /// Drops what `other` has.
    pub(crate) fn drop_all(&mut self, other: &Self) {
        self.words.iter_mut().zip(&other.words).for_each(|(word, other)| *word &= !other);
    }

    /// What both have.
    pub(crate) fn and(&self, other: &Self) -> Self {
        let mut both = self.clone();
        both.keep(other);
        both
    }

    /// How many both have.
    pub(crate) fn n_common(&self, other: &Self) -> usize {
        self.words.iter().zip(&other.words).map(|(a, b)| (a & b).count_ones() as usize).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_across_words() {
        let mut set = VertexSet::empty(130);
        [129, 0, 63, 64].iter().for_each(|&vertex| set.insert(vertex));
        assert_eq!(set.iter().collect::<Vec<_>>(), [0, 63, 64, 129]);
        set.remove(0);
        assert_eq!((set.len(), set.first(), set.contains(0), set.contains(64)), (3, Some(63), false, true));
        assert_eq!(VertexSet::all(130).n_common(&set), 3);
        let mut rest = VertexSet::all(130);
        rest.drop_all(&set);
        assert_eq!(rest.len(), 127);
        assert!(rest.and(&set).is_empty() && VertexSet::empty(0).is_empty());
    }
}
