//! hough-heuristic
