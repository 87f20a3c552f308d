"""The plant ``franka``: an arm over libfranka's network interface, real or franky-sim."""
