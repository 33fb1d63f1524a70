//! grasp-agent
