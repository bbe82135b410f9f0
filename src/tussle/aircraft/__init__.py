"""Aircraft of JSBSim's file format, compiled: XML -> typed model -> one kernel that steps all aircraft of a kind."""
