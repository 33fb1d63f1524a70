//! qtable
