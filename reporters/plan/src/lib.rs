//! A plan view of a road network, small enough to be sent.
