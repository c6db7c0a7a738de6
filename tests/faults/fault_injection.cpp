// Preloaded into a program (LD_PRELOAD), makes one of its system calls on regular files fail:
//   KAIROS_FAULT=OPERATION:N:ERRNO     the N-th pread, write, create, rename or close-after-writing, counted
//   from 1 KAIROS_FAULT_LOG=FILE              gets a line when that happened
// Calls below the C library's wrappers, so that nothing of the program has to know. Used by scripts/faults.
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

struct Fault {
  char operation[16] = "";
  long at = 0;
  int error = 0;
  std::atomic<long> seen{0};

  Fault() {
    if (const char* text = std::getenv("KAIROS_FAULT"))
      std::sscanf(text, "%15[a-z]:%ld:%d", operation, &at, &error);
  }
};

// True, with errno set, when this call is the one that fails.
bool fails(const char* operation) {
  static Fault fault;
  if (std::strcmp(operation, fault.operation) != 0 || ++fault.seen != fault.at) return false;
  if (const char* log = std::getenv("KAIROS_FAULT_LOG")) {
    const int fd = int(syscall(SYS_openat, AT_FDCWD, log, O_WRONLY | O_CREAT | O_TRUNC, 0666));
    syscall(SYS_write, fd, "failed\n", 7);
    syscall(SYS_close, fd);
  }
  errno = fault.error;
  return true;
}

bool regular(int fd) {
  struct stat status;
  return fd > 2 && fstat(fd, &status) == 0 && S_ISREG(status.st_mode);
}

bool openForWriting(int fd) {
  const long flags = syscall(SYS_fcntl, fd, F_GETFL);
  return flags >= 0 && (flags & O_ACCMODE) != O_RDONLY;
}

}  // namespace

extern "C" {

ssize_t pread(int fd, void* to, size_t bytes, off_t offset) {
  if (regular(fd) && fails("pread")) return -1;
  return syscall(SYS_pread64, fd, to, bytes, offset);
}
ssize_t pread64(int fd, void* to, size_t bytes, off_t offset) {
  return pread(fd, to, bytes, offset);
}

ssize_t write(int fd, const void* from, size_t bytes) {
  if (regular(fd) && fails("write")) {
    // A disk that fills up takes a part first.
    syscall(SYS_write, fd, from, bytes / 2);
    return -1;
  }
  return syscall(SYS_write, fd, from, bytes);
}

int open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? mode_t(va_arg(arguments, int)) : 0;
  va_end(arguments);
  if ((flags & O_CREAT) != 0 && fails("create")) return -1;
  return int(syscall(SYS_openat, AT_FDCWD, path, flags, mode));
}

int rename(const char* from, const char* to) {
  if (fails("rename")) return -1;
  return int(syscall(SYS_renameat, AT_FDCWD, from, AT_FDCWD, to));
}

int close(int fd) {
  const bool failing = regular(fd) && openForWriting(fd) && fails("close");
  const int error = errno;
  const int result = int(syscall(SYS_close, fd));
  if (failing) errno = error;
  return failing ? -1 : result;
}
}
