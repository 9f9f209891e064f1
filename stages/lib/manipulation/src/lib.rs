//! Grasp and placement spaces, connected regions, transit and transfer leaves.
