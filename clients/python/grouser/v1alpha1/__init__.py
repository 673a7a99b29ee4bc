"""Messages and stubs of the services, made by protoc from proto/grouser/v1alpha1 when Grouser is built."""
