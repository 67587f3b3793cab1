"""What the movements of a valve in service say of it: travel, signature, dead band and steps, updated slowly."""
